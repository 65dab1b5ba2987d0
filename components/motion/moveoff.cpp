// SPDX-License-Identifier: MIT
#include <array>
#include <cstdint>
#include <vector>

#include "axis_planner.hpp"
#include "hal/component.hpp"
#include "hal/interruption.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

constexpr std::size_t max_joints = 9;
using Offsets = std::array<double, max_joints>;

struct Moveoff : hal::Component {
    using Component::Component;
    hal::Argument personality{*this,
                              "personality",
                              3,
                              "number of joints",
                              {.per_instance = true, .min = 1, .max = max_joints}};

    hal::Function read{*this, "read-inputs", &Moveoff::read_inputs,
                       "computes the offsets; add it before write-outputs"};
    hal::Function write{*this, "write-outputs", &Moveoff::write_outputs,
                        "adds the offsets to commands and feedback; add it after read-inputs"};

    hal::In<bool> power_on{*this, "power-on", "TRUE: the machine is on (motion.motion-enabled)"};
    hal::In<bool> move_enable{*this, "move-enable",
                              "with apply-offsets TRUE, TRUE moves the offsets to offset-in"};
    hal::In<bool> apply_offsets{*this, "apply-offsets",
                                "with move-enable TRUE, TRUE moves the offsets to offset-in"};
    hal::In<bool> backtrack_enable{
        *this, "backtrack-enable", "TRUE: offsets return along their path", {.initial = true}};
    hal::In<double> epsilon{*this,
                            "epsilon",
                            "tolerance for reaching a waypoint; at least 0.0001",
                            {.initial = 0.0005}};
    hal::In<double> threshold{
        *this, "waypoint-threshold", "motion of a joint that adds a waypoint", {.initial = 0.02}};
    hal::In<double> sample_time{*this,
                                "waypoint-sample-secs",
                                "minimum time between waypoints",
                                {.initial = 0.02, .unit = "s"}};
    hal::Out<bool> warning{*this, "warning",
                           "TRUE: apply-offsets became FALSE with offsets active"};
    hal::Out<bool> offset_applied{*this, "offset-applied", "TRUE while an offset is not 0"};
    hal::Out<bool> waypoint_limit{
        *this, "waypoint-limit",
        "TRUE: the waypoint memory is full; the offsets are held until they return"};
    hal::Out<std::int32_t> waypoint_count{*this, "waypoint-ct", "number of stored waypoints"};
    hal::Out<std::int32_t> waypoint_percent{
        *this, "waypoint-percent-used", "used part of the waypoint memory", {.unit = "%"}};
    hal::Ins<double> offset_in{*this, "offset-in-#", personality, "target offset of joint #"};
    hal::Ins<double> pos{*this, "pos-#", personality,
                         "commanded position of joint # from the motion controller"};
    hal::Ins<double> fb{*this, "fb-#", personality, "feedback of joint #"};
    hal::Outs<double> offset_current{*this, "offset-current-#", personality,
                                     "current offset of joint #"};
    hal::Outs<double> pos_plus{*this, "pos-plusoffset-#", personality,
                               "commanded position of joint # plus its offset, for the motor"};
    hal::Outs<double> fb_minus{*this, "fb-minusoffset-#", personality,
                               "feedback of joint # minus its offset, for the motion controller"};
    hal::Limits max_velocity{
        *this, "offset-vel-#", personality, "maximum speed of offset #", {.initial = 10.0}};
    hal::Limits max_acceleration{*this,
                                 "offset-accel-#",
                                 personality,
                                 "maximum acceleration of offset #",
                                 {.initial = 100.0}};
    hal::Limits min{
        *this, "offset-min-#", personality, "lowest offset of joint #", {.initial = -1e20}};
    hal::Limits max{
        *this, "offset-max-#", personality, "highest offset of joint #", {.initial = 1e20}};
    hal::In<bool> limit_test{*this, "dbg-waypoint-limit-test",
                             "TRUE limits the memory to ten waypoints"};
    hal::Out<std::int32_t> state{
        *this, "dbg-state", "0: no offsets, 1: moving to offset-in, 2: returning, 3: machine off"};

    void read_inputs(hal::Cycle cycle) noexcept {
        const double dt = cycle.seconds();
        const bool wanted = move_enable && apply_offsets;
        if (interruption_.accept()) {
            stop_at_once();
        }
        if (!power_on) return pause();
        paused_ = false;

        if (state_ == idle && !wanted) {
            settle();
        }
        if (state_ == idle && wanted) {
            start();
        } else if (state_ == follows && !wanted) {
            state_ = returns;
        } else if (state_ == returns && wanted) {
            state_ = follows;
        }

        if (state_ == follows) {
            follow(dt);
        } else if (state_ == returns) {
            go_back(dt);
        }
        publish();
    }

    void write_outputs(hal::Cycle) noexcept {
        for (std::size_t i = 0; i < pos.size(); ++i) {
            const double offset = axes_[i].position();
            fb_minus[i] = fb[i] - applied_[i];  // the feedback belongs to the last command
            offset_current[i] = offset;
            pos_plus[i] = pos[i] + offset;
            applied_[i] = offset;
        }
    }

private:
    static constexpr std::size_t max_waypoints = 1000;
    enum : std::int32_t { idle = 0, follows = 1, returns = 2, off = 3 };

    void stop_at_once() noexcept {
        for (auto& axis : axes_) {
            axis.stop_at_once();
        }
    }

    void pause() noexcept {
        stop_at_once();
        paused_ = true;
        publish();
    }

    /// Reads the waypoint settings, only while there are no offsets.
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
        const std::size_t capacity = limit_test ? 10 : max_waypoints;
        const bool full = used_ >= capacity;
        for (std::size_t i = 0; i < pos.size(); ++i) {
            const double target =
                std::min(std::max(offset_in[i].get(), min[i].get()), max[i].get());
            axes_[i].step(full ? nullptr : &target, max_velocity[i], max_acceleration[i], dt);
        }
        since_ = std::min(since_ + dt, 1e9);
        if (full || since_ < every_) return;
        bool moved = false;
        for (std::size_t i = 0; i < pos.size(); ++i) {
            moved = moved || std::fabs(axes_[i].position() - last_[i]) > step_;
        }
        if (!moved) return;
        since_ = 0.0;
        for (std::size_t i = 0; i < pos.size(); ++i) {
            last_[i] = axes_[i].position();
        }
        waypoints_[used_++] = last_;
    }

    void go_back(double dt) noexcept {
        if (!backtrack_enable) {
            used_ = 0;
        }
        const Offsets target = used_ > 0 ? waypoints_[used_ - 1] : Offsets{};
        bool near = true;
        bool there = true;
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
        for (std::size_t i = 0; i < pos.size(); ++i) {
            any = any || !axes_[i].at(0.0);
        }
        offset_applied = any;
        warning = any && !apply_offsets && (warning || was_applying_);
        was_applying_ = apply_offsets;
        const std::size_t capacity = limit_test ? 10 : max_waypoints;
        waypoint_limit = state_ == follows && used_ >= capacity;
        waypoint_count = static_cast<std::int32_t>(used_);
        waypoint_percent =
            static_cast<std::int32_t>(std::min<std::size_t>(100 * used_ / capacity, 100));
        state = paused_ ? std::int32_t{off} : state_;
    }

    std::array<plan::Axis, max_joints> axes_;
    Offsets applied_{};
    Offsets last_{};
    // allocated here, not in a cycle
    std::vector<Offsets> waypoints_ = std::vector<Offsets>(max_waypoints);
    std::size_t used_ = 0;
    std::int32_t state_ = idle;
    bool paused_ = false;
    bool was_applying_ = false;
    double since_ = 0.0;
    double near_ = 0.0005;
    double step_ = 0.02;
    double every_ = 0.02;
    hal::Interruption interruption_{*this};
    hal::Retained retained_{*this,
                            {{"axes", axes_},
                             {"interruption", interruption_},
                             {"applied", applied_},
                             {"last", last_},
                             {"waypoints", waypoints_},
                             {"used", used_},
                             {"state", state_},
                             {"paused", paused_},
                             {"was-applying", was_applying_},
                             {"since", since_},
                             {"near", near_},
                             {"step", step_},
                             {"every", every_}}};
};

}  // namespace

HAL_COMPONENT(Moveoff, "moveoff",
              "Adds offsets to joint positions, for example to move the tool away during a pause",
              R"(
    pos-plusoffset = pos + offset,   fb-minusoffset = fb - offset

While `power-on`, `move-enable` and `apply-offsets` are TRUE, each offset moves to its `offset-in`,
within `offset-min` and `offset-max`, `offset-vel` and `offset-accel`. When one of the enables
becomes FALSE, the offsets return to 0: with `backtrack-enable` along the waypoints of their path,
else each joint directly. A waypoint is stored when a joint has moved by `waypoint-threshold`, at
most every `waypoint-sample-secs`. The memory holds 1000 waypoints; when it is full, the offsets are
held until they return. The three waypoint settings are read while there are no offsets.

`warning` is TRUE after `apply-offsets` becomes FALSE with offsets active, until they are 0 or it is
TRUE again; no message is printed. While `power-on` is FALSE the offsets are held. The component
does not know the machine's limits: set `offset-min` and `offset-max`.

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
