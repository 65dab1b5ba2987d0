// SPDX-License-Identifier: MIT
// The state machine of CiA 402 and the faults. Numbers in comments are those of the transitions.
#include <cmath>
#include <numbers>

#include "drive_axis.hpp"

namespace hal::canopen::cia402 {

namespace {
struct CauseRow {
    std::uint16_t code;
    std::uint8_t register_bits;
    bool controllable;  // the motor can still be braked by a ramp
};
constexpr CauseRow cause_rows[] = {
    {error::over_current, error_current, false},
    {error::over_voltage, error_voltage, true},
    {error::under_voltage, error_voltage, true},
    {error::over_temperature, error_temperature, true},
    {error::position_sensor, error_profile, false},
    {error::over_speed, error_profile, true},
    {error::heartbeat, error_communication, true},
    {error::following_error, error_profile, true},
};
constexpr double hottest = 1.1;  // times the heat of the rated torque
}  // namespace

bool DriveAxis::torque_state() const noexcept {
    return state_ == State::operation_enabled || state_ == State::quick_stop_active ||
           state_ == State::fault_reaction_active;
}

void DriveAxis::enter(State state) noexcept {
    const bool was = torque_state();
    const bool gently = stopping_;
    state_ = state;
    stopping_ = false;
    after_stop_ = State::unknown;
    enable_next_ = false;
    const bool has_brake = settings_.motor.brake_torque > 0;
    if (torque_state() && !was) {
        engage_left_ = 0;
        release_left_ = has_brake ? settings_.motor.brake_release : 0;
        restart_mode();
        follow();
    } else if (!torque_state() && was) {
        // Torque is kept until the brake holds, unless it must be removed at once.
        engage_left_ =
            has_brake && gently && stop_ != Stop::disable ? settings_.motor.brake_engage : 0;
        restart_mode();
    }
}

void DriveAxis::stop_then(Stop stop, State then) noexcept {
    if (stop == Stop::disable) return enter(then);
    stopping_ = true;
    stop_ = stop;
    after_stop_ = then;
    stop_time_ = still_time_ = 0;
}

void DriveAxis::take_controlword() noexcept {
    using namespace control;
    const auto word = objects_.controlword;
    const auto rising = static_cast<std::uint16_t>(word & ~control_);
    control_ = word;
    edges_ |= rising;
    if ((rising & fault_reset) != 0 && state_ == State::fault) return try_reset();
    if ((word & fault_reset) != 0) return;
    const bool no_voltage = (word & enable_voltage) == 0;

    const bool quick = !no_voltage && (word & not_quick_stop) == 0;

    const bool shutdown = !no_voltage && !quick && (word & control::switch_on) == 0;

    const bool enable = !no_voltage && !quick && !shutdown && (word & enable_operation) != 0;
    switch (state_) {
    case State::switch_on_disabled:
        // 2
        if (shutdown && dc_link_ >= 0.7 * settings_.motor.rated_voltage) {
            enter(State::ready_to_switch_on);
        }
        break;
    case State::ready_to_switch_on:
        if (no_voltage || quick) {
            return enter(State::switch_on_disabled);  // 7
        }
        if (shutdown) break;
        enter(State::switched_on);  // 3
        enable_next_ = enable;
        break;
    case State::switched_on:
        if (no_voltage || quick) {
            return enter(State::switch_on_disabled);  // 10
        }
        if (shutdown) {
            return enter(State::ready_to_switch_on);             // 6
        }
        if (!enable) {
            enable_next_ = false;
        } else if (!enable_next_) {
            enter(State::operation_enabled);           // 4
        }
        break;
    case State::operation_enabled: {
        if (no_voltage) {
            return enter(State::switch_on_disabled);  // 9
        }
        if (quick) {                                              // 11
            const int option = objects_.quick_stop_option;
            state_ = State::quick_stop_active;
            restart_mode();
            return stop_then(
                static_cast<Stop>(option >= stay_in_quick_stop ? option - 4 : option),
                option >= stay_in_quick_stop ? State::unknown : State::switch_on_disabled);
        }
        if (enable) {  // stays enabled; a stop for another transition is cancelled
            if (stopping_) {
                stopping_ = false;
                after_stop_ = State::unknown;
                restart_mode();
            }
            break;
        }
        const auto option = static_cast<Stop>(shutdown ? objects_.shutdown_option
                                                       : objects_.disable_operation_option);
        const auto then = shutdown ? State::ready_to_switch_on : State::switched_on;  // 8, 5
        if (stopping_ && option != Stop::disable) {
            after_stop_ = then;
        } else {
            stop_then(option, then);
        }
        break;
    }
    case State::quick_stop_active:
        if (no_voltage) {
            return enter(State::switch_on_disabled);  // 12
        }
        if (enable && objects_.quick_stop_option >= stay_in_quick_stop) {
            state_ = State::operation_enabled;  // 16
            stopping_ = false;
            restart_mode();
        }
        break;
    default: break;
    }
}

void DriveAxis::go_on_with_state(double dt) noexcept {
    if (state_ == State::not_ready_to_switch_on) {
        enter(State::switch_on_disabled);  // 1
    }
    if (state_ == State::switched_on && enable_next_) {
        enter(State::operation_enabled);  // 4
    }
    if (state_ == State::fault_reaction_active && !stopping_) {
        enter(State::fault);      // 14
    }
    if (release_left_ > 0) {
        release_left_ -= dt;
    }
    if (engage_left_ > 0) {
        engage_left_ -= dt;
    }
}

void DriveAxis::lose_connection() noexcept {
    if (state_ != State::switched_on && !torque_state()) return;
    if (state_ == State::fault_reaction_active) return;
    switch (static_cast<AbortConnection>(objects_.abort_connection_option)) {
    case AbortConnection::none: return;
    case AbortConnection::fault: return raise(Cause::connection);
    case AbortConnection::disable_voltage: objects_.controlword = command::disable_voltage; break;
    case AbortConnection::quick_stop: objects_.controlword = command::quick_stop; break;
    }
    take_controlword();
    publish();
}

// Faults.

bool DriveAxis::present(Cause cause) const noexcept {
    const auto simulated = [&](std::uint16_t bit) {
        return (objects_.simulated_faults & bit) != 0;
    };
    switch (cause) {
    case Cause::over_current:
        return simulated(simulated::over_current) || plant_.heat() > (faults_ & 1 ? 1.0 : hottest);
    case Cause::over_voltage:
        return simulated(simulated::over_voltage) || dc_link_ > 1.3 * settings_.motor.rated_voltage;
    case Cause::under_voltage:
        return simulated(simulated::under_voltage) ||
               dc_link_ < 0.7 * settings_.motor.rated_voltage;
    case Cause::over_temperature: return simulated(simulated::over_temperature);
    case Cause::position_sensor: return simulated(simulated::encoder_broken) || encoder_cut_;
    case Cause::over_speed:
        return std::abs(plant_.speed()) >
               1.2 * settings_.motor.highest_speed * std::numbers::pi / 30;
    case Cause::connection: return device_ != nullptr && !device_->error_control().all_alive();
    case Cause::following_error: return false;
    }
    return false;
}

void DriveAxis::watch_causes() noexcept {
    for (unsigned n = 0; n < causes; ++n) {
        const auto cause = static_cast<Cause>(n);
        if (cause == Cause::connection || cause == Cause::following_error) continue;
        // Missing voltage is not a fault while the drive is off.
        if (cause == Cause::under_voltage && state_ != State::switched_on && !torque_state()) {
            continue;
        }
        if (present(cause)) {
            raise(cause);
        }
    }
}

void DriveAxis::raise(Cause cause, std::int32_t detail) noexcept {
    const auto bit = static_cast<std::uint16_t>(1U << static_cast<unsigned>(cause));
    const auto& row = cause_rows[static_cast<unsigned>(cause)];
    if ((faults_ & bit) == 0) {
        faults_ |= bit;
        objects_.error_code = row.code;
        Emcy::Bytes bytes{static_cast<std::uint8_t>(number_)};
        store(bytes.data() + 1, detail);
        if (device_ != nullptr) {
            device_->emcy().raise(row.code, row.register_bits, bytes,
                                  static_cast<std::uint8_t>(number_ + 1));
        }
    } else if (state_ == State::fault || state_ == State::fault_reaction_active) {
        return;
    }
    const bool had_torque = torque_state();
    if (state_ == State::fault) return;
    if (state_ == State::fault_reaction_active) {
        if (!row.controllable) {
            enter(State::fault);
        }
        return;
    }
    // 13; if there is nothing to brake, or no way to, 14 follows with the next step.
    const auto reaction = static_cast<Stop>(objects_.fault_reaction_option);
    state_ = State::fault_reaction_active;
    stopping_ = enable_next_ = false;
    engage_left_ = release_left_ = 0;
    restart_mode();
    if (had_torque && row.controllable && reaction != Stop::disable) {
        follow();
        stop_then(reaction, State::fault);
    } else {
        loop_ = Control::off;
    }
    publish();
}

void DriveAxis::try_reset() noexcept {
    for (unsigned n = 0; n < causes; ++n) {
        if ((faults_ & 1U << n) != 0 && present(static_cast<Cause>(n))) return;
    }
    for (unsigned n = 0; n < causes; ++n) {
        if ((faults_ & 1U << n) != 0 && device_ != nullptr) {
            device_->emcy().clear(cause_rows[n].code, static_cast<std::uint8_t>(number_ + 1));
        }
    }
    faults_ = 0;
    objects_.error_code = 0;
    enter(State::switch_on_disabled);  // 15
}

}  // namespace hal::canopen::cia402
