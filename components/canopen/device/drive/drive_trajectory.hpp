// SPDX-License-Identifier: MIT
// Set-points made from set-points: a ramp, a trapezoidal profile to a place, and the line between two set-points of a master.
#pragma once

#include <array>
#include <cstdint>

namespace hal::canopen::cia402 {

/// Where a motion shall be and how it gets there; one unit of length throughout, seconds.
struct Motion {
    double position = 0, velocity = 0, acceleration = 0;
};

/// The velocity goes towards `target`: faster by `acceleration`, slower by `deceleration`, through 0 if need be. The position follows
/// exactly. [realtime]
void ramp(Motion&, double target, double acceleration, double deceleration, double dt) noexcept;

/// A motion of constant accelerations from where one is, at whatever velocity, to a place, there with velocity 0 or another one.
class Profile {
public:
    struct Limits {
        double velocity = 0, acceleration = 0, deceleration = 0;  ///< amounts
        double end_velocity = 0;                                  ///< at the target, in the direction of the motion
    };
    /// What cannot stop in time goes past the target and comes back. [realtime]
    void plan(const Motion& from, double target, const Limits&) noexcept;
    /// Moves on; what is left of `dt` when it arrives is returned. [realtime]
    double step(Motion&, double dt) noexcept;
    void clear() noexcept { count_ = next_ = 0; }
    bool done() const noexcept { return next_ == count_; }
    double target() const noexcept { return target_; }

private:
    struct Segment {
        double time, acceleration;
    };
    void add(double time, double acceleration) noexcept;
    std::array<Segment, 5> segments_{};
    std::uint8_t count_ = 0, next_ = 0;
    double elapsed_ = 0, target_ = 0, end_velocity_ = 0;
};

/// Takes the corners off a motion: what it gives is the mean of the motion over the last `time` seconds, so an acceleration a grows and
/// falls with the jerk a/time, the motion ends at the same place, `time` later, and no velocity or acceleration is exceeded.
class Smoother {
public:
    static constexpr double longest = 1.0;  ///< s
    /// The motion goes on from `now` with its velocity, as if it had always had it. [realtime]
    void begin(const Motion& now, double time) noexcept;
    /// The motion before its corners are off; whoever makes it moves it on, then calls step(). [realtime]
    Motion& raw() noexcept { return raw_; }
    /// `dt` after the last. [realtime]
    Motion step(double dt) noexcept;
    /// The last step() gave that.
    bool gave(const Motion& m) const noexcept { return m.position == given_.position && m.velocity == given_.velocity; }
    bool gave_velocity(const Motion& m) const noexcept { return m.velocity == given_.velocity; }
    /// The motion has not changed its velocity for `time`. [realtime]
    bool settled() const noexcept { return steady_ >= time_; }
    double time() const noexcept { return time_; }

private:
    struct Piece {
        double time, from, to, velocity_from, velocity_to, area;
    };
    static constexpr unsigned room = 1024;
    static constexpr double shortest = 0.00105;  // pieces of less are put together
    std::array<Piece, room> pieces_{};
    unsigned head_ = 0, count_ = 0;
    double time_ = 0, held_ = 0, area_ = 0, steady_ = 0;  // time and area of all pieces
    double origin_ = 0;                                   // positions of the pieces count from here, so that no digit is lost
    Motion raw_, before_, given_;
};

/// From where one is to the next set-point in the time between two of them; then it waits there.
class Interpolator {
public:
    void hold(double position) noexcept { from_ = to_ = position, left_ = period_ = 0; }
    /// [realtime]
    void next(double position, double target, double period) noexcept {
        from_ = position, to_ = target, period_ = left_ = period > 0 ? period : 0;
    }
    /// Moves on; what is left of `dt` when it arrives is returned. The velocity is the mean one over `dt`. [realtime]
    double step(Motion&, double dt) noexcept;
    bool arrived() const noexcept { return left_ <= 0; }

private:
    double from_ = 0, to_ = 0, period_ = 0, left_ = 0;
};

}  // namespace hal::canopen::cia402
