// SPDX-License-Identifier: MIT
#include "cia402/drive/plant.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hal::cia402 {

namespace {
constexpr double max_step = 0.00025;
constexpr double infinity = std::numeric_limits<double>::infinity();
/// Returns the part of a difference that is left after a time; 0: none.
double rest_after(double dt, double time_constant) noexcept {
    return time_constant > 0 ? std::exp(-dt / time_constant) : 0;
}
double towards(double value, double goal, double rest) noexcept {
    return rest > 0 ? goal + (value - goal) * rest : goal;
}
}  // namespace

std::optional<double> Range::edge(double before, double after, bool rising) const noexcept {
    if (!exists()) return std::nullopt;
    const bool forward = after > before;
    const double place = forward == rising ? from : to;
    const bool passed =
        forward ? before < place && place <= after : before >= place && place > after;
    return passed ? std::optional(place) : std::nullopt;
}

Plant::Plant(const MotorSettings& motor) noexcept
    : motor_(motor),
      per_radian_(motor.resolution / (2 * std::numbers::pi)),
      place_(motor.start),
      before_(motor.start) {}

Range Plant::negative_limit() const noexcept { return {-infinity, motor_.negative_limit}; }
Range Plant::positive_limit() const noexcept { return {motor_.positive_limit, infinity}; }

void Plant::step(double dt, double demand, double load, bool brake_closed) noexcept {
    before_ = place_;
    if (rests(demand, load) && within_stops()) return;
    const int steps = std::max(1, static_cast<int>(std::ceil(dt / max_step)));
    const double h = dt / steps;
    if (h != decay_.length) {
        decay_ = {h, rest_after(h, motor_.current_loop_time),
                  rest_after(h, motor_.thermal_time_constant)};
    }
    const double damping = 1 + h * motor_.viscous_friction / motor_.inertia;
    const double still =
        (motor_.coulomb_friction + (brake_closed ? motor_.brake_torque : 0)) * h / motor_.inertia;
    for (int n = 0; n < steps; ++n) {
        torque_ = towards(torque_, demand, decay_.torque);
        double speed = (speed_ + h * (torque_ + load) / motor_.inertia) / damping;
        if (speed > still) {
            speed = speed - still;
        } else if (speed < -still) {
            speed = speed + still;
        } else {
            speed = 0;
        }
        // Trapezoidal in the place: exact for a constant acceleration.
        place_ += 0.5 * (speed_ + speed) * h * per_radian_;
        speed_ = speed;
        if (place_ >= motor_.positive_stop) {
            place_ = motor_.positive_stop;
            speed_ = std::min(speed_, 0.0);
        }
        if (place_ <= motor_.negative_stop) {
            place_ = motor_.negative_stop;
            speed_ = std::max(speed_, 0.0);
        }
        const double share = motor_.rated_torque > 0 ? torque_ / motor_.rated_torque : 0;
        heat_ = towards(heat_, share * share, decay_.heat);
    }
}

std::optional<double> Plant::index_pulse(double from, int direction) const noexcept {
    if (!motor_.index_pulse || motor_.resolution == 0 || (place_ - before_) * direction <= 0) {
        return std::nullopt;
    }
    const double turn = motor_.resolution;
    if (direction > 0) {
        const double next = (std::floor(std::max(from, before_) / turn) + 1) * turn;
        return next <= place_ ? std::optional(next) : std::nullopt;
    }
    const double next = (std::ceil(std::min(from, before_) / turn) - 1) * turn;
    return next >= place_ ? std::optional(next) : std::nullopt;
}

}  // namespace hal::cia402
