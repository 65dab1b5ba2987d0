// SPDX-License-Identifier: MIT
#include "cia402/drive/drivetrain.hpp"

#include <algorithm>
#include <cmath>

namespace hal::cia402 {

namespace {
constexpr double friction_slope = 0.5;  // rad/s
}

Drivetrain::Drivetrain(const AxisSettings& settings, const AxisValues& values)
    : settings_(settings),
      values_(values),
      plant_(settings.motor),
      scale_(values, settings.motor) {}

void Drivetrain::power_up() noexcept {
    encoder_zero_ = motor().absolute_encoder ? 0 : std::floor(plant_.place());
    measured_ = plant_.place() - encoder_zero_;
    scale_.set_origin(0);
    saturated_ = false;
    follow();
}

void Drivetrain::follow() noexcept {
    reference.control = Control::off;
    reference.motion = {measured_, speed(), 0};
    reference.start = measured_;
    reference.torque = 0;
    integral_ = 0;
}

void Drivetrain::close(Control control) noexcept {
    const Control before = reference.control;
    if (control == before) return;
    if (before != Control::position) {
        reference.motion.position = measured_;
        reference.start = measured_;
    }
    if (before == Control::off || before == Control::torque) {
        reference.motion.velocity = standing() ? 0 : speed();
        keep_torque();
    }
    if (control == Control::torque) {
        reference.torque = plant_.torque();
    }
    reference.motion.acceleration = 0;
    reference.control = control;
}

bool Drivetrain::standing() const noexcept {
    const double threshold = values_.velocity_threshold * scale_.speed();
    return std::abs(speed()) <= (threshold > 0 ? threshold : motor().resolution / 100.0);
}

bool Drivetrain::blocked(int direction) const noexcept {
    const Range limit = direction > 0 ? plant_.positive_limit() : plant_.negative_limit();
    return limit.holds(plant_.place());
}

double Drivetrain::within_limits(double target) noexcept {
    const auto limits = scale_.software_limits();
    const double result = std::clamp(target, limits.from, limits.to);
    if (result != target) {
        reference.limited = true;
    }
    return result;
}

void Drivetrain::step(double dt, const Disturbance& disturbance) noexcept {
    const double torque = control_torque(dt, disturbance.torque_offset);
    plant_.step(dt, torque, disturbance.load, disturbance.brake_closed);
    if (!disturbance.encoder_broken) {
        measured_ = plant_.place() - encoder_zero_;
    }
    if (reference.control == Control::velocity || reference.control == Control::torque) {
        reference.motion.position = measured_;
    }
}

double Drivetrain::control_torque(double dt, double torque_offset) noexcept {
    saturated_ = false;
    if (reference.control == Control::off) {
        velocity_demand_ = 0;
        torque_demand_ = 0;
        return 0;
    }
    const double share = std::min<double>({static_cast<double>(values_.max_torque),
                                           static_cast<double>(values_.max_current),
                                           motor().peak_torque / motor().rated_torque * 1000});
    const Range limits{-scale_.torque(std::min<double>(share, values_.negative_torque_limit)),
                       scale_.torque(std::min<double>(share, values_.positive_torque_limit))};
    const double max_speed = scale_.max_speed() / plant_.increments_per_radian();
    const double torque = reference.control == Control::torque
                              ? torque_at_speed_limit(max_speed)
                              : velocity_loop(dt, max_speed, limits, torque_offset);
    torque_demand_ = std::clamp(torque, limits.from, limits.to);
    saturated_ = torque_demand_ != torque;
    return torque_demand_;
}

/// Returns the torque of the reference; at the highest speed no torque accelerates it further.
double Drivetrain::torque_at_speed_limit(double max_speed) noexcept {
    velocity_demand_ = plant_.speed() * plant_.increments_per_radian();
    const double per_speed = settings_.loop.velocity * motor().inertia;
    const double low = std::min(0.0, (-max_speed - plant_.speed()) * per_speed);
    const double high = std::max(0.0, (max_speed - plant_.speed()) * per_speed);
    const double torque = std::clamp(reference.torque, low, high);
    if (torque != reference.torque) {
        reference.limited = true;
    }
    return torque;
}

double Drivetrain::velocity_loop(double dt, double max_speed, Range torque_limits,
                                 double torque_offset) noexcept {
    const LoopSettings& gain = settings_.loop;
    const double increments = plant_.increments_per_radian();
    const double ahead = reference.motion.velocity / increments;
    double requested = ahead;
    if (reference.control == Control::position) {
        requested += gain.position * (reference.start - measured_) / increments;
    }
    const double velocity = std::clamp(requested, -max_speed, max_speed);
    if (velocity != requested) {
        reference.limited = true;
    }
    velocity_demand_ = velocity * increments;
    const double error = velocity - plant_.speed();
    const double friction =
        motor().viscous_friction * ahead +
        motor().coulomb_friction * std::clamp(velocity / friction_slope, -1.0, 1.0);
    const double acceleration = gain.feed_forward * reference.motion.acceleration / increments;
    const double torque = motor().inertia * (gain.velocity * error + integral_ + acceleration) +
                          gain.feed_forward * friction + torque_offset;
    const bool may_rise = torque <= torque_limits.to || error < 0;
    const bool may_fall = torque >= torque_limits.from || error > 0;
    if (may_rise && may_fall) {
        integral_ += gain.integral * gain.velocity * error * dt;
    }
    return torque;
}

}  // namespace hal::cia402
