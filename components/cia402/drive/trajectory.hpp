// SPDX-License-Identifier: MIT
// Trajectories: a ramp, a trapezoidal profile to a place, and the interpolation between two
// set-points of a master.
#pragma once

#include <array>
#include <cstdint>

namespace hal::cia402 {

/// State of a motion; one unit of length throughout, seconds.
struct Motion {
    double position = 0;
    double velocity = 0;
    double acceleration = 0;
};

/// Moves the velocity towards `target`, speeding up by `acceleration`, slowing down by
/// `deceleration`, through 0 if necessary. The position is integrated exactly. [realtime]
void ramp(Motion&, double target, double acceleration, double deceleration, double dt) noexcept;

/// A motion of constant accelerations from any state to a place, arriving with a given velocity, 0
/// by default.
class Profile {
public:
    struct Limits {
        double velocity = 0;
        double acceleration = 0;
        double deceleration = 0;  ///< amounts
        /// at the target, in the direction of the motion
        double end_velocity = 0;
    };
    /// Plans the motion; if it cannot stop in time, it passes the target and returns. [realtime]
    void plan(const Motion& from, double target, const Limits&) noexcept;
    /// Advances by `dt` s. Returns the remaining part of `dt` after arrival. [realtime]
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
    std::uint8_t count_ = 0;
    std::uint8_t next_ = 0;
    double elapsed_ = 0;
    double target_ = 0;
    double end_velocity_ = 0;
};

/// Limits the jerk of a motion: its output is the mean of the motion over the last `time` seconds.
/// An acceleration a grows and falls with the jerk a/time; the motion ends at the same place,
/// `time` later, and exceeds no velocity or acceleration.
class Smoother {
public:
    static constexpr double max_time = 1.0;  ///< s
    /// Starts from `now`, as if the motion had always had its velocity. [realtime]
    void begin(const Motion& now, double time) noexcept;
    /// Returns the motion before smoothing; the caller advances it, then calls step(). [realtime]
    Motion& raw() noexcept { return raw_; }
    /// Returns the smoothed motion `dt` s after the last call. [realtime]
    Motion step(double dt) noexcept;
    /// Returns true when `m` is the result of the last step().
    bool gave(const Motion& m) const noexcept {
        return m.position == given_.position && m.velocity == given_.velocity;
    }
    bool gave_velocity(const Motion& m) const noexcept { return m.velocity == given_.velocity; }
    /// Returns true when the motion has not changed its velocity for `time`. [realtime]
    bool settled() const noexcept { return steady_ >= time_; }
    double time() const noexcept { return time_; }

private:
    struct Segment {
        double time, from, to, velocity_from, velocity_to, area;
    };
    static constexpr unsigned capacity = 1024;
    static constexpr double min_segment = 0.00105;  // shorter segments are merged
    std::array<Segment, capacity> segments_{};
    unsigned head_ = 0;
    unsigned count_ = 0;
    double time_ = 0;
    double held_ = 0;
    double area_ = 0;
    double steady_ = 0;  // time and area of all segments
    // origin of the positions of the segments, to keep precision
    double origin_ = 0;
    Motion raw_, before_, given_;
};

/// Interpolates from the present position to the next set-point over the time between two of them,
/// then waits there.
class Interpolator {
public:
    void hold(double position) noexcept {
        from_ = to_ = position;
        left_ = period_ = 0;
    }
    /// [realtime]
    void next(double position, double target, double period) noexcept {
        from_ = position;
        to_ = target;
        period_ = left_ = period > 0 ? period : 0;
    }
    /// Advances by `dt` s. Returns the remaining part of `dt` after arrival. The velocity is the
    /// mean one over `dt`. [realtime]
    double step(Motion&, double dt) noexcept;
    bool arrived() const noexcept { return left_ <= 0; }

private:
    double from_ = 0;
    double to_ = 0;
    double period_ = 0;
    double left_ = 0;
};

}  // namespace hal::cia402
