// SPDX-License-Identifier: MIT
// How a step generator that is commanded by its rate follows a position.
//
// In each period T the rate is chosen so that position and velocity of the command are met as soon
// as the acceleration allows. With the error e = position - command, the relative velocity r =
// velocity - velocity of the command, and the acceleration a, velocities match after |r| / a, in
// steps of a T per period, and the error is then
//
//     m = e + r |r| / (2 a) - r T / 2
//
// If they can match within this period, m is e, and the rate is the velocity of the command less
// half of e per period. Otherwise the velocity changes by a for the period, in the direction after which |m| is
// smaller. Where the error is so great that m does not depend on that choice within the precision of a
// number, its sign decides.
#pragma once

#include <algorithm>
#include <cmath>

namespace hal::mesa {

class StepControl {
public:
    struct Limits {
        double velocity = 0.0;  ///< units/s, reached within the acceleration; 0: none
        double acceleration = 0.0;  ///< units/s^2; 0: none
        double possible = 0.0;  ///< units/s that are never exceeded; 0: none
    };

    /// Stands at a position: at a start and while disabled. [realtime]
    void hold(double command) noexcept {
        set_command(command);
        velocity_ = 0.0;
    }
    /// Returns the velocity of this period on the way to a standstill: there is no valid command.
    /// [realtime]
    double brake(double position, double period_s, const Limits& limits) noexcept {
        const double velocity = follow_velocity(0.0, position, period_s, limits);
        begins_anew_ = true;
        return velocity;
    }

    /// Returns the velocity for this period in units/s. `position` is where the axis is when the new
    /// rate takes effect. [realtime]
    double follow_position(double command, double position, double period_s,
                           const Limits& limits) noexcept {
        if (begins_anew_) {
            set_command(command);  // its first value is not a movement
        }
        feed_forward_ = (command - command_) / period_s;
        const double error = position - command_;
        command_ = command;
        const double relative = velocity_ - feed_forward_;
        const double a = limits.acceleration;
        double wanted = 0.0;
        if (a <= 0.0 || std::abs(relative) <= a * period_s) {
            error_at_match_ = error;
            wanted = feed_forward_ - 0.5 * error / period_s;
        } else {
            error_at_match_ = at_match(error, relative, a, period_s);
            wanted = ramp(error, relative, a, period_s);
        }
        return apply(wanted, period_s, limits);
    }
    /// [realtime]
    double follow_velocity(double command, double position, double period_s,
                           const Limits& limits) noexcept {
        command_ = position;
        feed_forward_ = command;
        error_at_match_ = 0.0;
        return apply(command, period_s, limits);
    }
    /// Positions are smaller by `distance` from now on: a command in the new ones is not a movement.
    /// [realtime]
    void move_origin(double distance) noexcept { command_ -= distance; }
    /// Sets the velocity that the generator really has: rates are whole numbers. [realtime]
    void set_velocity(double velocity) noexcept { velocity_ = velocity; }

    double command() const noexcept { return command_; }
    double velocity() const noexcept { return velocity_; }
    double feed_forward() const noexcept { return feed_forward_; }
    double error_at_match() const noexcept { return error_at_match_; }

private:
    static double at_match(double error, double relative, double a, double period_s) noexcept {
        return error + relative * std::abs(relative) / (2.0 * a) - relative * period_s / 2.0;
    }
    /// A command that is not a number is replaced by the next one that is followed.
    void set_command(double command) noexcept {
        begins_anew_ = !std::isfinite(command);
        command_ = begins_anew_ ? 0.0 : command;
    }
    double ramp(double error, double relative, double a, double period_s) const noexcept {
        const double change = a * period_s;
        const double fastest = std::abs(relative) + change;
        const double near = fastest * fastest / a + 4.0 * fastest * period_s;
        if (std::abs(error) > near) return velocity_ - std::copysign(change, error);
        const double towards = relative > 0.0 ? -a : a;
        const double away = -towards;
        const double later = relative + away * period_s;
        const double away_match = at_match(error + later * period_s, later, a, period_s);
        const bool is_better = std::abs(away_match) < std::abs(error_at_match_);
        return velocity_ + (is_better ? away : towards) * period_s;
    }
    /// A velocity above a lowered limit falls within the acceleration.
    double apply(double wanted, double period_s, const Limits& limits) noexcept {
        if (!std::isfinite(wanted)) {
            wanted = 0.0;
        }
        if (limits.velocity > 0.0) {
            wanted = std::clamp(wanted, -limits.velocity, limits.velocity);
        }
        if (limits.acceleration > 0.0) {
            const double change = limits.acceleration * period_s;
            wanted = std::clamp(wanted, velocity_ - change, velocity_ + change);
        }
        if (limits.possible > 0.0) {
            wanted = std::clamp(wanted, -limits.possible, limits.possible);
        }
        velocity_ = wanted;
        return velocity_;
    }

    double command_ = 0.0;
    double velocity_ = 0.0;
    double feed_forward_ = 0.0;
    double error_at_match_ = 0.0;
    bool begins_anew_ = false;  // the next command that is followed is not a movement
};

}  // namespace hal::mesa
