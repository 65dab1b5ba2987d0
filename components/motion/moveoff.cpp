// SPDX-License-Identifier: MIT
#include <array>
#include <cstdint>
#include <vector>

#include "axis_planner.hpp"
#include "hal/component.hpp"

namespace {

constexpr std::size_t most_joints = 9;
using Offsets = std::array<double, most_joints>;

struct Moveoff : hal::Component {
    using Component::Component;
    hal::Argument personality{*this, "personality", 3, "how many joints", {.per_instance = true, .min = 1, .max = most_joints}};

    hal::Function read{*this, "read-inputs", &Moveoff::read_inputs, "moves the offsets; first"};
    hal::Function write{*this, "write-outputs", &Moveoff::write_outputs, "adds the offsets to positions and feedback; second"};

    hal::In<bool>   power_on{*this, "power-on", "TRUE: the machine is on (motion.motion-enabled)"};
    hal::In<bool>   move_enable{*this, "move-enable", "TRUE, and apply-offsets: offsets follow offset-in"};
    hal::In<bool>   apply_offsets{*this, "apply-offsets", "TRUE, and move-enable: offsets follow offset-in"};
    hal::In<bool>   backtrack_enable{*this, "backtrack-enable", "TRUE: offsets return the way they went", {.initial = true}};
    hal::In<double> epsilon{*this, "epsilon", "a waypoint counts as reached this near; at least 0.0001", {.initial = 0.0005}};
    hal::In<double> threshold{*this, "waypoint-threshold", "motion of one joint that makes a waypoint", {.initial = 0.02}};
    hal::In<double> sample_time{*this, "waypoint-sample-secs", "shortest time between waypoints", {.initial = 0.02, .unit = "s"}};
    hal::Out<bool>  warning{*this, "warning", "TRUE: apply-offsets went FALSE while there were offsets"};
    hal::Out<bool>  offset_applied{*this, "offset-applied", "TRUE: there are offsets"};
    hal::Out<bool>  waypoint_limit{*this, "waypoint-limit", "TRUE: no room for waypoints, offsets stand until they are told to return"};
    hal::Out<std::int32_t> waypoint_count{*this, "waypoint-ct", "waypoints kept"};
    hal::Out<std::int32_t> waypoint_percent{*this, "waypoint-percent-used", "share of the room for them", {.unit = "%"}};
    hal::Ins<double>  offset_in{*this, "offset-in-#", personality, "wanted offset of joint #"};
    hal::Ins<double>  pos{*this, "pos-#", personality, "position of joint # from the motion"};
    hal::Ins<double>  fb{*this, "fb-#", personality, "feedback of joint #"};
    hal::Outs<double> offset_current{*this, "offset-current-#", personality, "offset of joint #"};
    hal::Outs<double> pos_plus{*this, "pos-plusoffset-#", personality, "position of joint # with its offset, for the motor"};
    hal::Outs<double> fb_minus{*this, "fb-minusoffset-#", personality, "feedback of joint # without its offset, for the motion"};
    hal::Ins<double>  max_velocity{*this, "offset-vel-#", personality, "largest speed of offset #", {.initial = 10.0}};
    hal::Ins<double>  max_acceleration{*this, "offset-accel-#", personality, "largest acceleration of offset #", {.initial = 100.0}};
    hal::Ins<double>  min{*this, "offset-min-#", personality, "lowest offset of joint #", {.initial = -1e20}};
    hal::Ins<double>  max{*this, "offset-max-#", personality, "highest offset of joint #", {.initial = 1e20}};
    hal::In<bool>     limit_test{*this, "dbg-waypoint-limit-test", "TRUE: room for ten waypoints only"};
    hal::Out<std::int32_t> state{*this, "dbg-state", "0: no offsets, 1: offsets follow, 2: they return, 3: the machine is off"};

    void read_inputs(hal::Cycle cycle) noexcept {
        const double dt = cycle.seconds();
        const bool wanted = move_enable && apply_offsets;
        if (!power_on) return pause();
        paused_ = false;

        if (state_ == idle && !wanted) settle();
        if (state_ == idle && wanted) start();
        else if (state_ == follows && !wanted) state_ = returns;
        else if (state_ == returns && wanted) state_ = follows;

        if (state_ == follows) follow(dt);
        else if (state_ == returns) go_back(dt);
        publish();
    }

    void write_outputs(hal::Cycle) noexcept {
        for (std::size_t i = 0; i < pos.size(); ++i) {
            const double offset = axes_[i].position();
            fb_minus[i] = fb[i] - applied_[i];  // the feedback is that of the last command
            offset_current[i] = offset;
            pos_plus[i] = pos[i] + offset;
            applied_[i] = offset;
        }
    }

private:
    static constexpr std::size_t room = 1000;
    enum : std::int32_t { idle = 0, follows = 1, returns = 2, off = 3 };

    void pause() noexcept {
        for (auto& axis : axes_) axis.stop_at_once();
        paused_ = true;
        publish();
    }

    /// Only at rest do the settings of waypoints count.
    void settle() noexcept {
        near_ = epsilon >= 0.0001 ? epsilon.get() : 0.0001;
        step_ = threshold > 0.0 ? threshold.get() : 0.0;
        every_ = sample_time > 0.0 ? sample_time.get() : 0.0;
    }

    void start() noexcept {
        settle();
        used_ = 0;
        last_ = Offsets{};
        since_ = 0.0;
        state_ = follows;
    }

    void follow(double dt) noexcept {
        const std::size_t most = limit_test ? 10 : room;
        const bool full = used_ >= most;
        for (std::size_t i = 0; i < pos.size(); ++i) {
            const double target = std::min(std::max(offset_in[i].get(), min[i].get()), max[i].get());
            axes_[i].step(full ? nullptr : &target, max_velocity[i], max_acceleration[i], dt);
        }
        since_ = std::min(since_ + dt, 1e9);
        if (full || since_ < every_) return;
        bool moved = false;
        for (std::size_t i = 0; i < pos.size(); ++i) moved = moved || std::fabs(axes_[i].position() - last_[i]) > step_;
        if (!moved) return;
        since_ = 0.0;
        for (std::size_t i = 0; i < pos.size(); ++i) last_[i] = axes_[i].position();
        waypoints_[used_++] = last_;
    }

    void go_back(double dt) noexcept {
        if (!backtrack_enable) used_ = 0;
        const Offsets target = used_ > 0 ? waypoints_[used_ - 1] : Offsets{};
        bool near = true, there = true;
        for (std::size_t i = 0; i < pos.size(); ++i) {
            axes_[i].step(&target[i], max_velocity[i], max_acceleration[i], dt);
            near = near && std::fabs(axes_[i].position() - target[i]) <= near_;
            there = there && axes_[i].at(target[i]) && axes_[i].resting();
        }
        if (used_ > 0 && near) {
            --used_;
            last_ = used_ > 0 ? waypoints_[used_ - 1] : Offsets{};
        } else if (used_ == 0 && there) {
            state_ = idle;
        }
    }

    void publish() noexcept {
        bool any = false;
        for (std::size_t i = 0; i < pos.size(); ++i) any = any || !axes_[i].at(0.0);
        offset_applied = any;
        warning = any && !apply_offsets && (warning || was_applying_);
        was_applying_ = apply_offsets;
        const std::size_t most = limit_test ? 10 : room;
        waypoint_limit = state_ == follows && used_ >= most;
        waypoint_count = static_cast<std::int32_t>(used_);
        waypoint_percent = static_cast<std::int32_t>(std::min<std::size_t>(100 * used_ / most, 100));
        state = paused_ ? std::int32_t{off} : state_;
    }

    std::array<plan::Axis, most_joints> axes_;
    Offsets applied_{}, last_{};
    std::vector<Offsets> waypoints_ = std::vector<Offsets>(room);  // the memory is touched here, not in a cycle
    std::size_t used_ = 0;
    std::int32_t state_ = idle;
    bool paused_ = false, was_applying_ = false;
    double since_ = 0.0, near_ = 0.0005, step_ = 0.02, every_ = 0.02;
};

}  // namespace

HAL_COMPONENT(Moveoff, "moveoff", "Offsets of joint positions, for example to step aside while a program is paused", R"(
    pos-plusoffset = pos + offset,   fb-minusoffset = fb - offset

While `power-on`, `move-enable` and `apply-offsets` are TRUE, each offset moves to its `offset-in`, within `offset-min` and `offset-max`,
`offset-vel` and `offset-accel`. When one of the enables falls, the offsets return to 0: with `backtrack-enable` from waypoint to waypoint
the way they went, else each joint directly. A waypoint is kept when a joint has moved by `waypoint-threshold`, not more often than every
`waypoint-sample-secs`; there is room for 1000. When it is used up the offsets stand until they are told to return. The three settings of
waypoints are read while there are no offsets.

`warning` is TRUE from when `apply-offsets` falls while there are offsets until they are gone or it is TRUE again; a text is not printed.
While `power-on` is FALSE the offsets stay as they are. Nothing here knows the machine's limits: use `offset-min` and `offset-max`.

    loadrt moveoff names=mv personality=2
    addf mv.read-inputs servo
    addf mv.write-outputs servo
    net x-cmd    => mv.pos-0
    net x-motor  <= mv.pos-plusoffset-0
    net x-enc    => mv.fb-0
    net x-fb     <= mv.fb-minusoffset-0
    net paused   => mv.apply-offsets
    net step-off => mv.move-enable
)")
