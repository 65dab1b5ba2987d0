// SPDX-License-Identifier: MIT
// Trapezoidal motion of one axis in steps of one period, for simple_tp and moveoff.
#pragma once

#include <algorithm>
#include <cmath>

namespace plan {

inline constexpr double huge = 1e20;  // beyond it sums would lose all digits, or overflow

/// Returns the largest distance for one period after which a stop exactly at a point `distance`
/// ahead is still possible, if the distance per period may change by at most `a` from one period to
/// the next. Counted back from the stop, the distances of a braking axis are a, 2a, 3a ... and add
/// up to p(j) = a j (j + 1) / 2. A `distance` at a fraction between p(j) and p(j + 1) gives the
/// same fraction between j a and (j + 1) a; the remaining distance is then at that fraction between
/// p(j - 1) and p(j), so the axis arrives exactly. [realtime]
inline double braking_way(double distance, double a) noexcept {
    const double j = std::floor(std::sqrt(0.25 + 2.0 * distance / a) - 0.5);
    const double share = (distance - 0.5 * a * j * (j + 1.0)) / (a * (j + 1.0));
    return a * (j + std::clamp(share, 0.0, 1.0));
}

/// Position and velocity of an axis.
class Axis {
public:
    double position() const noexcept { return position_; }
    double velocity() const noexcept { return velocity_; }
    bool resting() const noexcept { return velocity_ == 0.0; }
    void stop_at_once() noexcept { velocity_ = 0.0; }
    bool at(double target) const noexcept { return position_ == target; }

    /// Moves for one period towards `target`; without a target, or with one that is NaN or beyond
    /// 1e20, brakes to a stop. Limits that are not positive count as 0. [realtime]
    void step(const double* target, double max_velocity, double max_acceleration,
              double dt) noexcept {
        const double a = max_acceleration > 0.0 ? std::clamp(max_acceleration, 1e-20, huge) : 0.0;
        const double limit = max_velocity > 0.0 ? std::min(max_velocity, huge) : 0.0;
        const double left =
            target != nullptr && std::fabs(*target) <= huge ? *target - position_ : 0.0;

        const double change = a * dt;
        double wanted = 0.0;
        if (left != 0.0 && change > 0.0) {
            wanted = std::copysign(std::min(braking_way(std::fabs(left), change * dt) / dt, limit),
                                   left);
        }
        velocity_ += std::clamp(wanted - velocity_, -change, change);

        const double way = velocity_ * dt;
        // without it the last bits would never be covered
        const double rounding = 1e-14 * (std::fabs(position_) + std::fabs(left));
        position_ = left != 0.0 && std::fabs(left - way) <= rounding ? *target : position_ + way;
    }

private:
    double position_ = 0.0;

private:
    double velocity_ = 0.0;
};

}  // namespace plan
