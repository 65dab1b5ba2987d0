// SPDX-License-Identifier: MIT
#include "ethercat/devices/servo.hpp"

#include <algorithm>
#include <cmath>

namespace hal::ethercat::devices {

namespace o402 = canopen::cia402::object;
namespace status = canopen::cia402::status;
namespace control = canopen::cia402::control;
using canopen::cia402::Mode;

namespace {

constexpr double torque_to_acceleration = 5000.0;  // increments/s² per 0.1 % of the rated torque
constexpr double friction = 5.0;                   // 1/s

double limited_step(double from, double to, double most) noexcept {
    return from + std::clamp(to - from, -most, most);
}

}  // namespace

ServoAxis::ServoAxis(Dictionary& d, unsigned axis) {
    const auto at = [&](std::uint16_t index, std::uint8_t sub = 0) {
        return d.at(canopen::cia402::of_axis(index, axis), sub);
    };
    d_ = {at(o402::controlword),
          at(o402::statusword),
          at(o402::modes_of_operation),
          at(o402::modes_of_operation_display),
          at(o402::position_actual),
          at(o402::velocity_actual),
          at(o402::torque_actual),
          at(o402::target_position),
          at(o402::target_velocity),
          at(o402::target_torque),
          at(o402::velocity_offset),
          at(o402::position_offset),
          at(o402::error_code),
          at(o402::following_error_actual),
          at(o402::following_error_window),
          at(o402::profile_velocity),
          at(o402::profile_acceleration),
          at(o402::profile_deceleration),
          at(o402::quick_stop_deceleration),
          at(o402::max_profile_velocity),
          at(o402::software_position_limit, 1),
          at(o402::software_position_limit, 2),
          at(o402::homing_method),
          at(o402::homing_speeds, 1),
          at(o402::home_offset),
          at(o402::digital_inputs),
          at(o402::digital_outputs, 1),
          at(o402::max_torque),
          at(o402::position_demand),
          at(o402::supported_modes)};
}

void ServoAxis::power_on() noexcept {
    state_ = DriveState::switch_on_disabled;  // self-test passed
    control_ = 0;
    mode_ = 0;
    velocity_ = demand_ = goal_ = torque_ = 0;
    // the shaft stays where it is, an absolute encoder reads it
    offset_ = 0;
    position_ = std::round(position_);
    acknowledged_ = moving_to_goal_ = homed_ = homing_ = following_fault_ = limited_ = reached_ =
        false;
    // read by SDOs before SAFE-OP
    put(d_.status, status_bits());

    put(d_.position, static_cast<std::int32_t>(std::llround(position_)));
    shown_status_.store(get<std::uint16_t>(d_.status), std::memory_order_relaxed);
}

void ServoAxis::fault(std::uint16_t code, Step& s) noexcept {
    if (state_ == DriveState::fault) return;
    state_ = DriveState::fault;
    put(d_.error_code, code);
    coe::Emergency e;
    e.code = code;
    e.error_register = 0x21;
    s.emergency = e;
}

void ServoAxis::walk(const Step& s) noexcept {
    const std::uint16_t word = s.outputs_valid ? get<std::uint16_t>(d_.control) : std::uint16_t{0};
    const bool reset = (word & control::fault_reset) != 0 && (control_ & control::fault_reset) == 0;
    control_ = word;
    const unsigned command = word & 0x0fU;
    const bool voltage = (command & 2) != 0;
    const bool quick = voltage && (command & 4) == 0;
    const bool shutdown = (command & 7) == 6;
    const bool on = (command & 15) == 7;

    const bool enable = (command & 15) == 15;
    switch (state_) {
    case DriveState::fault:
        if (reset) {
            state_ = DriveState::switch_on_disabled, put<std::uint16_t>(d_.error_code, 0),
            following_fault_ = false;
        }
        break;
    case DriveState::switch_on_disabled:
        if (shutdown) {
            state_ = DriveState::ready_to_switch_on;
        }
        break;
    case DriveState::ready_to_switch_on:
        if (!voltage || quick) {
            state_ = DriveState::switch_on_disabled;
        } else if (on || enable) {
            state_ = DriveState::switched_on;
        }
        break;
    case DriveState::switched_on:
        if (!voltage || quick) {
            state_ = DriveState::switch_on_disabled;
        } else if (shutdown) {
            state_ = DriveState::ready_to_switch_on;
        } else if (enable) {
            state_ = DriveState::operation_enabled;
            demand_ = goal_ = position_;

            moving_to_goal_ = homing_ = false;
        }
        break;
    case DriveState::operation_enabled:
        if (!voltage) {
            state_ = DriveState::switch_on_disabled;
        } else if (quick) {
            state_ = DriveState::quick_stop_active;
        } else if (shutdown) {
            state_ = DriveState::ready_to_switch_on;
        } else if (on) {
            state_ = DriveState::switched_on;
        }
        break;
    case DriveState::quick_stop_active:
        // quick stop option 2
        if (!voltage || velocity_ == 0.0) {
            state_ = DriveState::switch_on_disabled;
        }
        break;
    default: state_ = DriveState::switch_on_disabled; break;
    }
    if (!s.outputs_valid && state_ != DriveState::fault) {
        state_ = DriveState::switch_on_disabled;
    }
}

double ServoAxis::toward(double target, double dt) noexcept {
    const double acceleration = std::max<double>(1, get<std::uint32_t>(d_.profile_acceleration));
    const double deceleration = std::max<double>(1, get<std::uint32_t>(d_.profile_deceleration));
    const double most =
        std::min(get<std::uint32_t>(d_.profile_velocity), get<std::uint32_t>(d_.max_velocity));
    const double distance = target - position_;
    if (std::abs(distance) < 0.5 && std::abs(velocity_) <= 2 * deceleration * dt) {
        position_ = target;
        return 0;
    }
    const double braking = std::sqrt(2 * deceleration * std::abs(distance));
    const double wanted =
        std::copysign(std::min({most, braking, std::abs(distance) / dt}), distance);
    const bool brakes = std::abs(wanted) < std::abs(velocity_);
    return limited_step(velocity_, wanted, (brakes ? 4 * deceleration : acceleration) * dt);
}

double ServoAxis::homing_velocity(double dt) noexcept {
    const int method = static_cast<std::int8_t>(*d_.homing_method);
    const bool start = (control_ & control::start_homing) != 0;
    if (!start) {
        homing_ = false;
    } else if (!homing_ && !homed_) {
        homing_ = true;
        home_at_ =
            method == 37 || method == 35 ? position_ : std::floor(position_ / 10'000) * 10'000;
    }
    if (!homing_ || homed_) return 0;
    const double speed = get<std::uint32_t>(d_.homing_speed);
    const double distance = home_at_ - position_;
    if (std::abs(distance) < 0.5) {
        offset_ = get<std::int32_t>(d_.home_offset) - position_;
        homed_ = true;
        return 0;
    }
    return std::copysign(std::min(speed, std::abs(distance) / dt), distance);
}

double ServoAxis::wanted_velocity(double dt, bool operational) noexcept {
    const double most = get<std::uint32_t>(d_.max_velocity);
    limited_ = false;
    reached_ = false;
    if (!operational) return 0;
    const auto limit = [&](double v) {
        limited_ = limited_ || std::abs(v) > most;
        return std::clamp(v, -most, most);
    };
    switch (static_cast<Mode>(mode_)) {
    case Mode::cyclic_position: {
        double target = get<std::int32_t>(d_.target_position) +
                        static_cast<double>(get<std::int32_t>(d_.position_offset));
        const double low = get<std::int32_t>(d_.low_limit);
        const double high = get<std::int32_t>(d_.high_limit);
        if (low < high) {
            limited_ = target < low || target > high;
            target = std::clamp(target, low, high);
        }
        demand_ = target - offset_;
        return limit((demand_ - position_) / dt);
    }
    case Mode::cyclic_velocity:
        return limit(get<std::int32_t>(d_.target_velocity) +
                     static_cast<double>(get<std::int32_t>(d_.velocity_offset)));
    case Mode::profile_velocity: {
        const double target =
            (control_ & control::halt) != 0 ? 0.0 : limit(get<std::int32_t>(d_.target_velocity));
        const double rate =
            get<std::uint32_t>(std::abs(target) > std::abs(velocity_) ? d_.profile_acceleration
                                                                      : d_.profile_deceleration);
        reached_ = std::abs(velocity_ - target) < 1;
        return limited_step(velocity_, target, rate * dt);
    }
    case Mode::profile_position: {
        const bool request = (control_ & control::new_set_point) != 0;
        if (request && !acknowledged_) {
            const double target = get<std::int32_t>(d_.target_position);
            goal_ = (control_ & control::relative) != 0 ? goal_ + target : target - offset_;
            moving_to_goal_ = acknowledged_ = true;
        }
        if (!request) {
            acknowledged_ = false;
        }
        if ((control_ & control::halt) != 0) {
            return limited_step(velocity_, 0, get<std::uint32_t>(d_.profile_deceleration) * dt);
        }
        if (!moving_to_goal_) return 0;
        const double v = toward(goal_, dt);
        reached_ = position_ == goal_ && v == 0.0;
        return v;
    }
    case Mode::homing: return homing_velocity(dt);
    default: return 0;
    }
}

void ServoAxis::move(double velocity, double dt) noexcept {
    torque_ = std::clamp((velocity - velocity_) / dt / torque_to_acceleration, -3000.0, 3000.0);
    velocity_ = velocity;
    position_ += velocity * dt;
}

std::uint16_t ServoAxis::status_bits() const noexcept {
    unsigned word = 0;
    for (const auto& row : canopen::cia402::states) {
        if (row.state == state_) {
            word = row.value;
        }
    }
    word |= status::voltage_enabled | status::remote;
    if (state_ != DriveState::quick_stop_active && state_ != DriveState::switch_on_disabled) {
        word |= status::not_quick_stop;
    }
    if (limited_) {
        word |= status::internal_limit;
    }
    if (reached_) {
        word |= status::target_reached;
    }
    if (following_fault_) {
        word |= status::following_error;
    }
    if (state_ == DriveState::operation_enabled) {
        switch (static_cast<Mode>(mode_)) {
        case Mode::cyclic_position:
        case Mode::cyclic_velocity:
        case Mode::cyclic_torque: word |= status::follows_command; break;
        case Mode::profile_position:
            word |= acknowledged_ ? status::set_point_acknowledge : 0U;
            break;
        case Mode::profile_velocity: word |= velocity_ == 0.0 ? status::speed_is_zero : 0U; break;
        case Mode::homing:
            if (homed_) {
                word |= status::homing_attained | status::target_reached;
            } else if (homing_) {
                word |= 0U;
            } else {
                word |= status::target_reached + 0U;
            }
            break;
        default: break;
        }
    }
    return static_cast<std::uint16_t>(word);
}

void ServoAxis::step(Step& s) noexcept {
    const double dt = std::max(1e-9, static_cast<double>(s.dt_ns) * 1e-9);
    if (const auto code = fault_request_.exchange(0, std::memory_order_relaxed)) {
        fault(code, s);
    }
    walk(s);
    const auto wanted_mode = static_cast<std::int8_t>(*d_.mode);
    const auto modes = get<std::uint32_t>(d_.modes);
    if (wanted_mode != mode_ && (wanted_mode == 0 || (wanted_mode > 0 && wanted_mode <= 10 &&
                                                      (modes >> (wanted_mode - 1) & 1) != 0))) {
        mode_ = wanted_mode;
        homed_ = homing_ = moving_to_goal_ = false;
        goal_ = position_;
    }
    const bool enabled = state_ == DriveState::operation_enabled;
    if (s.dt_ns > 0) {
        if (enabled && static_cast<Mode>(mode_) == Mode::cyclic_torque) {
            const double most = get<std::uint16_t>(d_.torque_limit);
            torque_ = std::clamp<double>(get<std::int16_t>(d_.target_torque), -most, most);
            velocity_ += (torque_ * torque_to_acceleration - friction * velocity_) * dt;
            const double limit = get<std::uint32_t>(d_.max_velocity);
            limited_ = std::abs(velocity_) > limit;
            velocity_ = std::clamp(velocity_, -limit, limit);
            position_ += velocity_ * dt;
        } else if (enabled) {
            move(wanted_velocity(dt, true), dt);
        } else if (state_ == DriveState::quick_stop_active || state_ == DriveState::fault) {
            move(limited_step(velocity_, 0, get<std::uint32_t>(d_.quick_deceleration) * dt), dt);
        } else {
            const double coasting = velocity_ * std::exp(-friction * dt);
            move(std::abs(coasting) < 1 ? 0 : coasting, dt);
            torque_ = 0;
            limited_ = reached_ = false;
        }
    }
    const double error =
        enabled && static_cast<Mode>(mode_) == Mode::cyclic_position ? demand_ - position_ : 0;
    const auto window = get<std::uint32_t>(d_.following_window);
    if (window != 0xffffffff && std::abs(error) > window) {
        following_fault_ = true;
        fault(canopen::cia402::error::following_error, s);
    }
    const auto shown = [](double v) {
        return static_cast<std::int32_t>(static_cast<std::int64_t>(std::llround(v)));
    };
    put(d_.position, shown(position_ + offset_));
    put(d_.velocity, shown(velocity_));

    put(d_.demand, shown(demand_ + offset_));
    put(d_.torque, static_cast<std::int16_t>(torque_));
    put(d_.following_error, shown(error));
    *d_.mode_display = static_cast<std::uint8_t>(mode_);
    put(d_.status, status_bits());
    put(d_.digital_in, inputs_.load(std::memory_order_relaxed));
    outputs_.store(s.outputs_valid ? get<std::uint32_t>(d_.digital_out) : 0,
                   std::memory_order_relaxed);
    shown_position_.store(position_ + offset_, std::memory_order_relaxed);

    shown_velocity_.store(velocity_, std::memory_order_relaxed);
    shown_status_.store(get<std::uint16_t>(d_.status), std::memory_order_relaxed);
}

}  // namespace hal::ethercat::devices
