// SPDX-License-Identifier: MIT
// The scale of an axis: user units of the objects, encoder increments counted from power-on, and
// the limits that the objects set in them. Positions of the user have 32 bits, or the range of
// 607Bh, and wrap; the position of the axis does not.
#pragma once

#include <cmath>
#include <cstdint>

#include "cia402/drive/axis_values.hpp"
#include "cia402/drive/plant.hpp"
#include "cia402/drive/trajectory.hpp"

namespace hal::cia402 {

/// Rounds to the next integer, halves away from zero; clamps what is beyond any counter. [any]
inline std::int64_t whole(double value) noexcept {
    constexpr std::int64_t max = 1LL << 52;
    if (!(value > -static_cast<double>(max))) return -max;
    if (value > static_cast<double>(max)) return max;
    const auto towards_zero = static_cast<std::int64_t>(value);
    const double rest = value - static_cast<double>(towards_zero);
    return towards_zero + static_cast<int>(rest >= 0.5) - static_cast<int>(rest <= -0.5);
}

/// Converts 1/min to 1/s. [any]
constexpr double per_second(double per_minute) noexcept { return per_minute / 60; }

/// The scale. [realtime]
class AxisScale {
public:
    /// Both must outlive it. [setup]
    AxisScale(const AxisValues& values, const MotorSettings& motor) noexcept
        : values_(values), motor_(motor) {}

    /// Reads the factors of 608Fh, 6091h, 6092h, 6096h, 6097h and the polarity.
    void update() noexcept;
    /// Sets the encoder position that is 0 for the user.
    void set_origin(double encoder) noexcept { origin_ = encoder; }

    // Increments (per second, per second squared) per user unit; the first two have the sign of
    // 607Eh.
    double position() const noexcept { return position_; }
    double velocity() const noexcept { return velocity_; }
    double speed() const noexcept { return speed_; }

    double user(double encoder) const noexcept { return (encoder - origin_) / position_; }
    double encoder(double user) const noexcept { return origin_ + user * position_; }
    /// Returns a position as an object shows it.
    std::int32_t shown(double encoder) const noexcept;
    /// Returns the encoder position of an absolute target, for an axis that is at `near`: on a
    /// rotary axis in the direction of 60F2h.
    double absolute(std::int32_t target, double near) const noexcept;
    /// Returns the encoder position of a target, on the shortest way from `near`.
    double nearest(std::int32_t target, double near) const noexcept;
    /// Returns the limits of 607Dh as encoder positions; infinite without limits.
    Range software_limits() const noexcept;

    double max_speed() const noexcept;  ///< increments/s
    double acceleration(std::uint32_t requested) const noexcept;
    double deceleration(std::uint32_t requested) const noexcept;
    /// Returns the rate of a ramp of vl, increments/s².
    double rate_of(const Ramp&) const noexcept;
    Profile::Limits profile_limits() const noexcept;
    /// Returns the time over which the corners of a ramp are smoothed so that the steeper one keeps
    /// the jerk of 60A4h:1; 0: not smoothed.
    double corner_time() const noexcept;
    /// Returns the time between two set-points, 60C2h, s.
    double period() const noexcept;
    /// Returns N·m.
    double torque(double per_mille) const noexcept {
        return per_mille / 1000 * motor_.rated_torque;
    }

private:
    double range_span() const noexcept;

    const AxisValues& values_;
    const MotorSettings& motor_;
    double position_ = 1;
    double velocity_ = 1;
    double speed_ = 1;  // without the sign
    double acceleration_ = 1;
    double origin_ = 0;
};

}  // namespace hal::cia402
