// SPDX-License-Identifier: MIT
#include "cia402/drive/axis_monitor.hpp"

#include <algorithm>
#include <cmath>

namespace hal::cia402 {

double AxisMonitor::following_error() const noexcept {
    const Reference& reference = train_.reference;
    if (reference.control != Control::position) return 0;
    return reference.motion.position - train_.position();
}

bool AxisMonitor::watch_following(double dt, bool torque_on) noexcept {
    const auto window = values_.following_error_window;
    const double max = window * std::abs(train_.scale().position());
    result_.following_error = torque_on && window != no_window && std::abs(following_error()) > max;
    following_time_ = result_.following_error ? following_time_ + dt : 0;
    return result_.following_error && following_time_ * 1000 >= values_.following_error_timeout;
}

void AxisMonitor::watch_speed(double dt) noexcept {
    const double unit = train_.scale().speed();
    const double speed = train_.speed();
    const bool slow = std::abs(speed) < std::max(1.0, values_.velocity_threshold * unit);
    speed_zero_time_ = slow ? speed_zero_time_ + dt : 0;
    result_.speed_zero = slow && speed_zero_time_ * 1000 >= values_.velocity_threshold_time;
    const double slippage = std::abs(train_.reference.motion.velocity - speed);
    result_.slipping = values_.max_slippage > 0 && train_.reference.control == Control::velocity &&
                       slippage > values_.max_slippage * unit;
}

void AxisMonitor::read_inputs(std::uint32_t external) noexcept {
    const Plant& plant = train_.plant();
    inputs_before_ = inputs_;
    inputs_ = external;
    const auto sense = [&](const Range& range, std::uint32_t input) {
        if (range.holds(plant.place())) {
            inputs_ |= input;
        }
    };
    sense(plant.negative_limit(), input::negative_limit);
    sense(plant.positive_limit(), input::positive_limit);
    sense(plant.home(), input::home);
    sense(plant.probe(0), input::probe_1);
    sense(plant.probe(1), input::probe_2);
}

}  // namespace hal::cia402
