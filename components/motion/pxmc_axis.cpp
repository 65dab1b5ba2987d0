// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"
#include "profile.hpp"

namespace {

/// The values of pin `error-code`, which is public: never renumber them.
enum Error : std::uint32_t {
    none = 0,
    following_error = 1,
    below_min = 2,
    above_max = 3,
    too_fast = 4,
    bad_feedback = 5,
    bad_parameter = 6,
};

struct PxmcAxis : hal::Component {
    using Component::Component;

    hal::In<bool> enable{*this, "enable",
                         "TRUE closes the loop at the current position; FALSE sets output to 0"};
    hal::In<bool> reset{*this, "reset",
                        "a rising edge clears the error if its cause no longer exists"};
    hal::In<double> actual_position{*this, "actual-position", "measured position"};
    hal::In<bool> go{*this, "go", "a rising edge starts a move to requested-position"};
    hal::In<double> requested_position{*this, "requested-position", "target of the next go"};
    hal::In<bool> speed_mode{*this, "speed-mode", "TRUE moves at requested-speed instead"};
    hal::In<double> requested_speed{
        *this,
        "requested-speed",
        "speed in speed-mode; otherwise speed of the move, 0: max-speed",
        {.unit = "1/s"}};
    hal::In<bool> stop_in{*this, "stop", "TRUE brakes to a stop and discards the move"};

    hal::In<double> max_speed{
        *this, "max-speed", "maximum speed of the trajectory", {.initial = 1.0, .unit = "1/s"}};
    hal::In<double> max_acceleration{*this,
                                     "max-acceleration",
                                     "maximum acceleration of the trajectory",
                                     {.initial = 1.0, .unit = "1/s^2"}};
    hal::In<double> max_jerk{
        *this, "max-jerk", "maximum jerk of the trajectory; 0: no limit", {.unit = "1/s^3"}};
    hal::In<double> p_gain{
        *this, "P", "proportional gain: output per following error", {.initial = 1.0}};
    hal::In<double> i_gain{*this, "I", "integral gain: output per following error and second"};
    hal::In<double> d_gain{*this, "D", "derivative gain: output per speed error"};
    hal::In<double> feed_forward{*this, "FF", "feed-forward: output per commanded speed"};
    hal::OptionalLimit max_output{*this, "max-output", "limit on the output; 0: no limit"};

    hal::OptionalLimit max_following_error{
        *this, "max-following-error", "following error at which the axis faults; 0: not monitored"};
    hal::In<double> min_position{
        *this, "min-position", "lowest position", {.initial = -motion::farthest}};
    hal::In<double> max_position{
        *this, "max-position", "highest position", {.initial = motion::farthest}};
    hal::OptionalLimit position_margin{
        *this, "position-margin",
        "permitted overtravel beyond min-position and max-position; 0: not monitored"};
    hal::OptionalLimit overspeed{
        *this, "overspeed",
        "measured speed, as a multiple of max-speed, at which the axis faults; 0: not monitored"};
    hal::In<double> speed_filter{
        *this, "speed-filter", "time constant of actual-speed, 0 to 60", {.unit = "s"}};
    hal::In<double> window{
        *this, "position-window",
        "distance to the target at which busy ends; 0: busy ends with the trajectory"};

    hal::Out<double> output{*this, "output", "command to the motor", {.safe = 0.0, .finite = true}};
    hal::Out<double> position{
        *this, "commanded-position", "position of the trajectory", {.finite = true}};
    hal::Out<double> speed{
        *this, "commanded-speed", "speed of the trajectory", {.unit = "1/s", .finite = true}};
    hal::Out<double> actual_speed{
        *this, "actual-speed", "measured speed", {.unit = "1/s", .finite = true}};
    hal::Out<double> error_out{
        *this, "following-error", "commanded - actual position", {.finite = true}};
    hal::Out<bool> active{*this, "active", "TRUE while the axis is controlled", {.safe = false}};
    hal::Out<bool> busy{*this, "busy", "TRUE while moving"};
    hal::Out<bool> error{*this, "error", "TRUE: a fault has disabled the axis; see error-code"};
    hal::Out<std::uint32_t> error_code{*this, "error-code", "cause of the fault; see the table"};
    hal::Out<bool> request_limited{
        *this, "request-limited",
        "TRUE: the requested position or speed exceeds a limit and is reduced"};

    hal::Function run{*this, "do-control", &PxmcAxis::update,
                      "measures, monitors, plans and controls"};

    /// Measures, decides whether the axis is on, and then moves and controls it.
    void update(hal::Cycle cycle) noexcept {
        const double dt = cycle.seconds();
        const bool gone = go_edge_.rises(go);
        const bool cleared = reset_edge_.rises(reset);
        const bool measured =
            std::isfinite(actual_position) && std::fabs(actual_position) <= motion::farthest;
        if (measured) {
            measure(dt);
        }
        motion::Limits limits;
        const bool sound =
            motion::Limits::from(max_speed, max_acceleration, 0.0, max_jerk, limits) &&
            min_position <= max_position && monitors_are_valid();

        std::uint32_t found = none;
        if (!sound) {
            found = bad_parameter;
        } else if (!measured) {
            found = bad_feedback;
        }
        update_state(found, cleared, limits);
        if (!was_on_) return rest();
        if (closing_) {
            generator_.put(measured_);
            integral_ = 0.0;
            moves_ = false;
        }
        closing_ = false;
        command(limits, gone);
        generator_.advance(dt);
        control(dt);
    }

private:
    static constexpr double max_speed_filter_s = 60.0;

    /// Switches the axis on or off. `found`: what is wrong with the inputs; it is an error only
    /// while the axis is on. `cleared`: a reset, which works once nothing is wrong.
    void update_state(std::uint32_t found, bool cleared, const motion::Limits& limits) noexcept {
        if (cleared && found == none) {
            code_ = none;
        }
        if (!enable) {
            interrupted_ = false;
        } else if (was_on_ && !active) {
            interrupted_ = true;  // the outputs had their safe values meanwhile
        }
        const bool on = enable && code_ == none && !interrupted_;
        if (on && found == none && was_on_) {
            found = watch(limits);
        }
        if (on && found != none) {
            code_ = found;
        }
        was_on_ = on && code_ == none;
    }

    /// Returns whether the parameters of the supervision are valid: a negative limit, or a filter
    /// that passes no speed, would switch it off.
    bool monitors_are_valid() const noexcept {
        return max_following_error >= 0.0 && position_margin >= 0.0 && overspeed >= 0.0 &&
               speed_filter >= 0.0 && speed_filter <= max_speed_filter_s;
    }

    void measure(double dt) noexcept {
        const double raw = has_measured_ ? (actual_position - measured_) / dt : 0.0;
        const double share = speed_filter > 0.0 ? dt / (speed_filter + dt) : 1.0;
        speed_ += share * (raw - speed_);
        if (!std::isfinite(speed_)) {
            speed_ = 0.0;
        }
        measured_ = actual_position;
        has_measured_ = true;
        actual_speed = speed_;
    }

    std::uint32_t watch(const motion::Limits& limits) const noexcept {
        // returning from beyond a limit is not a fault, moving further outwards is
        if (position_margin > 0.0) {
            if (measured_ < min_position - position_margin && generator_.state().velocity <= 0.0 &&
                speed_ < 0.0) {
                return below_min;
            }
            if (measured_ > max_position + position_margin && generator_.state().velocity >= 0.0 &&
                speed_ > 0.0) {
                return above_max;
            }
        }
        if (overspeed > 0.0 && std::fabs(speed_) > overspeed * limits.velocity) return too_fast;
        if (max_following_error > 0.0 &&
            std::fabs(generator_.state().position - measured_) > max_following_error) {
            return following_error;
        }
        return none;
    }

    void command(motion::Limits limits, bool gone) noexcept {
        const double low = std::max(min_position.get(), -motion::farthest);

        const double high = std::min(max_position.get(), motion::farthest);
        const double asked = std::isfinite(requested_speed) ? requested_speed.get() : 0.0;
        if (stop_in) {
            moves_ = false;
        } else if (speed_mode) {
            // Towards the position limit at that speed, so that it also stops there in time.
            moves_ = false;
            request_limited = std::fabs(asked) > limits.velocity;
            if (asked != 0.0) {
                limits.velocity = std::clamp(std::fabs(asked), 1e-18, limits.velocity);
                return generator_.go_to(asked > 0.0 ? high : low, limits);
            }
        } else if (gone && std::isfinite(requested_position)) {
            target_ = requested_position;
            moves_ = true;
        }
        if (!moves_) return generator_.go_at(0.0, limits);
        const double to = std::clamp(target_, low, high);
        request_limited = to != target_ || std::fabs(asked) > limits.velocity;
        if (asked != 0.0) {
            limits.velocity = std::clamp(std::fabs(asked), 1e-18, limits.velocity);
        }
        generator_.go_to(to, limits);
    }

    void control(double dt) noexcept {
        const motion::State& now = generator_.state();
        const double e = now.position - measured_;
        const double max = std::fabs(max_output);
        double integral = integral_ + e * dt;
        const auto effort = [&](double sum) {
            return p_gain * e + i_gain * sum + d_gain * (now.velocity - speed_) +
                   feed_forward * now.velocity;
        };
        double wanted = effort(integral);
        // Anti-windup: do not integrate further into saturation.
        if (max > 0.0 && std::fabs(wanted) > max && i_gain * e * wanted > 0.0) {
            wanted = effort(integral = integral_);
        }
        if (!std::isfinite(wanted)) {
            code_ = bad_parameter;
            was_on_ = false;
            return rest();
        }
        integral_ = integral;
        output = max > 0.0 ? std::clamp(wanted, -max, max) : wanted;
        busy = (!generator_.arrived() || generator_.moving() ||
                (moves_ && window > 0.0 && std::fabs(e) > window));
        show();
    }

    void rest() noexcept {
        closing_ = true;
        moves_ = false;
        generator_.put(measured_);
        output = 0.0;
        busy = false;
        request_limited = false;
        show();
    }
    void show() noexcept {
        position = generator_.state().position;
        speed = generator_.state().velocity;
        error_out = generator_.state().position - measured_;
        active = was_on_;
        error = code_ != none;
        error_code = code_;
    }

    motion::Generator generator_;
    double measured_ = 0.0;
    double speed_ = 0.0;
    double integral_ = 0.0;
    double target_ = 0.0;
    std::uint32_t code_ = none;
    // TRUE from the first cycle on: not a rising edge
    hal::RisingEdge go_edge_{true};
    hal::RisingEdge reset_edge_{true};
    bool was_on_ = false;
    bool interrupted_ = false;  // until enable is FALSE
    bool closing_ = true;
    bool moves_ = false;

    bool has_measured_ = false;
    hal::Retained retained_{*this,
                            {{"generator", generator_},
                             {"measured", measured_},
                             {"speed", speed_},
                             {"integral", integral_},
                             {"target", target_},
                             {"code", code_},
                             {"was-go", go_edge_},
                             {"was-reset", reset_edge_},
                             {"was-on", was_on_},
                             {"interrupted", interrupted_},
                             {"closing", closing_},
                             {"moves", moves_},
                             {"has-measured", has_measured_}}};
};

}  // namespace

HAL_COMPONENT(PxmcAxis, "pxmc_axis",
              "Position controller of one axis: trajectory, PID, supervision", R"(
One axis as in the motion controllers of small mobile robots: it takes a position or a speed, plans
the trajectory, closes the loop and monitors it.

    commanded = time-optimal way to requested-position within max-speed, max-acceleration, max-jerk (see motion_profile)
    e         = commanded-position - actual-position
    output    = P e + I * integral of e + D (commanded-speed - actual-speed) + FF commanded-speed,  at most max-output

(G. Franklin, J. D. Powell, A. Emami-Naeini, *Feedback Control of Dynamic Systems*, 4.3; the
trajectory: T. Kroeger, *On-Line Trajectory Generation in Robotic Systems*, Springer 2010.) Units
are those of `actual-position`; all limits and gains may change at any time.

* `enable` closes the loop at the current position, at standstill; then `active` is TRUE. After a
  `stop` of the machine, or when the function was in no thread, the axis stays off until `enable`
  has a rising edge. A rising edge of `go` starts a move, also during a move.
* `speed-mode` moves at `requested-speed`, and stops at `min-position` and `max-position`. Positions
  beyond them are limited (`request-limited`).
* `stop` brakes with `max-acceleration`. `busy` is TRUE while the trajectory runs (and until the
  axis is within `position-window`).
* The integral is held while it would increase the saturation.

An error sets `output` to 0 in the same cycle and remains until a rising edge of `reset`; then the
axis holds its current position.

| error-code | |
| --- | --- |
| 0 | none |
| 1 | following error above `max-following-error` |
| 2, 3 | measured position below `min-position` or above `max-position` by more than `position-margin`, and moving outwards |
| 4 | measured speed above `overspeed` * `max-speed` |
| 5 | the feedback is NaN or infinite |
| 6 | an invalid parameter, see below, or the output is NaN because of a gain |

A parameter is invalid when `max-speed` or `max-acceleration` is 0, a limit other than `max-output` is
negative, `min-position` is above `max-position`, one of these is NaN, or `speed-filter` is not 0 to
60 s.

    loadrt pxmc_axis names=left-wheel
    addf left-wheel.do-control servo
    setp left-wheel.max-speed 1
    setp left-wheel.max-acceleration 5
    setp left-wheel.max-following-error 0.05
    setp left-wheel.P 100
    net left-position => left-wheel.actual-position
    net left-effort   <= left-wheel.output
    net left-busy     <= left-wheel.busy
)")
