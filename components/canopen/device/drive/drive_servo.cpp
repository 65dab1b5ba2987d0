// SPDX-License-Identifier: MIT
// The loops:
//     v* = v_ref + k_p (x_ref − x)                              position, P with feed-forward
//     a  = k_v (v* − v) + ∫ k_i k_v (v* − v) dt                 velocity, PI
//     T  = J (a + a_ref) + b v_ref + T_c sgn v* + offset        within the torque limits; the integral is frozen while they act
// x_ref is the demand at the beginning of the step, v_ref and a_ref those of the step. Around 0 sgn
// is a slope, to avoid chatter.
#include <algorithm>
#include <cmath>

#include "drive_axis.hpp"

namespace hal::canopen::cia402 {

namespace {
constexpr double slow = 0.5;  // rad/s
}

double DriveAxis::servo(double dt) noexcept {
    const auto& motor = settings_.motor;
    const auto& gain = settings_.loop;
    const double share = std::min<double>({static_cast<double>(objects_.max_torque),
                                           static_cast<double>(objects_.max_current),
                                           motor.peak_torque / motor.rated_torque * 1000});
    const double high = torque_of(std::min<double>(share, objects_.positive_torque_limit));

    const double low = -torque_of(std::min<double>(share, objects_.negative_torque_limit));
    const double increments = plant_.increments_per_radian();
    const double most = highest_speed() / increments;

    const double speed = plant_.speed();
    saturated_ = false;
    if (loop_ == Control::off) {
        velocity_wanted_ = torque_demand_ = 0;
        return 0;
    }
    double torque = torque_ref_;
    if (loop_ == Control::torque) {
        velocity_wanted_ = speed * increments;
        // At the highest speed no torque accelerates it further.
        const double room = gain.velocity * motor.inertia;
        torque = std::clamp(torque, std::min(0.0, (-most - speed) * room),
                            std::max(0.0, (most - speed) * room));
        if (torque != torque_ref_) {
            limited_ = true;
        }
    } else {
        double wanted = ref_.velocity / increments;
        if (loop_ == Control::position) {
            wanted += gain.position * (demand_before_ - measured_) / increments;
        }
        const double limited = std::clamp(wanted, -most, most);
        if (limited != wanted) {
            limited_ = true;
        }
        velocity_wanted_ = limited * increments;
        const double error = limited - speed;
        const double ahead = ref_.velocity / increments;
        const double friction = motor.viscous_friction * ahead +
                                motor.coulomb_friction * std::clamp(limited / slow, -1.0, 1.0);
        const double offset = mode_ == Mode::cyclic_position || mode_ == Mode::cyclic_velocity
                                  ? torque_of(objects_.torque_offset)
                                  : 0;
        torque = motor.inertia * (gain.velocity * error + integral_ +
                                  gain.feed_forward * ref_.acceleration / increments) +
                 gain.feed_forward * friction + offset;
        if ((torque <= high || error < 0) && (torque >= low || error > 0)) {
            integral_ += gain.integral * gain.velocity * error * dt;
        }
    }
    torque_demand_ = std::clamp(torque, low, high);
    saturated_ = torque_demand_ != torque;
    return torque_demand_;
}

}  // namespace hal::canopen::cia402
