// SPDX-License-Identifier: MIT
// Numbers in comments are those of the transitions.
#include "cia402/drive/drive_axis.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

namespace hal::cia402 {

namespace {

constexpr double warning_heat = 0.9;  // times the heat of the rated torque

constexpr unsigned reserved_touch_probe_bits = 0xc8c8;
constexpr unsigned reserved_positioning_bits = 0xff3c;
constexpr unsigned relative_positioning_bits = 0x0003;  // both set: reserved
constexpr unsigned reserved_polarity_bits = 0x3f;

/// Returns whether a write of the object changes the unit of the set-point.
constexpr bool scales_set_points(std::uint16_t index) noexcept {
    switch (index) {
    case object::polarity:
    case object::position_encoder_resolution:
    case object::gear_ratio:
    case object::feed_constant:
    case object::velocity_factor:
    case object::acceleration_factor: return true;
    default: return false;
    }
}

template <class T>
T limited(double value) noexcept {
    return static_cast<T>(std::clamp<std::int64_t>(whole(value), std::numeric_limits<T>::min(),
                                                   std::numeric_limits<T>::max()));
}

}  // namespace

DriveAxis::DriveAxis(const AxisSettings& settings)
    : settings_(possible(settings)),
      values_(settings_),
      around_{.dc_link = settings_.motor.rated_voltage},
      train_(settings_, values_),
      modes_(train_, values_, control_),
      monitor_(train_, values_),
      probes_(train_, monitor_, values_),
      faults_(train_, values_, around_) {
    power_up();
}

void DriveAxis::power_up() noexcept {
    state_ = State::not_ready_to_switch_on;
    control_ = {};
    stopping_.reset();
    enable_next_ = false;
    release_left_ = engage_left_ = 0;
    faults_.power_up();
    monitor_.power_up();
    probes_.power_up();
    train_.power_up();
    modes_.power_up();
    restart_modes();
    train_.scale().update();
    publish();
}

void DriveAxis::power_down() noexcept {
    state_ = State::not_ready_to_switch_on;
    control_ = {};
    stopping_.reset();
    enable_next_ = false;
    release_left_ = engage_left_ = 0;
    restart_modes();
    train_.follow();
    publish();
}

void DriveAxis::coast(double dt) noexcept {
    train_.step(dt, disturbance());
    publish_motion();
}

void DriveAxis::step(double dt) noexcept {
    train_.scale().update();
    continue_transitions(dt);
    watch_causes();
    if (modes_.select()) {
        restart_modes();
    }
    make_reference(dt);
    train_.step(dt, disturbance());
    if (monitor_.watch_following(dt, torque_on())) {
        const double error = monitor_.following_error() / train_.scale().position();
        raise(DriveFault::following_error, limited<std::int32_t>(error));
    }
    monitor_.watch_speed(dt);
    monitor_.read_inputs(around_.inputs);
    probes_.step();
    publish();
}

Disturbance DriveAxis::disturbance() const noexcept {
    const Mode mode = modes_.mode();
    const bool adds_torque = mode == Mode::cyclic_position || mode == Mode::cyclic_velocity;
    return {.load = around_.load + values_.load_torque / 1000.0,
            .torque_offset = adds_torque ? train_.scale().torque(values_.torque_offset) : 0,
            .brake_closed = brake_closed(),
            .encoder_broken = faults_.has_no_encoder()};
}

void DriveAxis::restart_modes() noexcept {
    modes_.restart();
    monitor_.restart();
}

bool DriveAxis::brake_closed() const noexcept {
    if (!has_brake()) return false;
    if ((values_.output_mask & values_.outputs & output::set_brake) != 0) return true;
    return torque_on() ? release_left_ > 0 : engage_left_ <= 0;
}

// The state machine.

bool DriveAxis::torque_on() const noexcept {
    return state_ == State::operation_enabled || state_ == State::quick_stop_active ||
           state_ == State::fault_reaction_active;
}

void DriveAxis::enter(State state) noexcept {
    const bool had_torque = torque_on();
    const auto stop = std::exchange(stopping_, std::nullopt);
    state_ = state;
    enable_next_ = false;
    if (torque_on() && !had_torque) {
        engage_left_ = 0;
        release_left_ = has_brake() ? settings_.motor.brake_release : 0;
        restart_modes();
        train_.follow();
    } else if (!torque_on() && had_torque) {
        // Torque is kept until the brake holds, unless it must be removed at once.
        const bool gently = stop && stop->ramp != Stop::disable;
        engage_left_ = has_brake() && gently ? settings_.motor.brake_engage : 0;
        restart_modes();
    }
}

void DriveAxis::stop_then(Stop ramp, State then) noexcept {
    if (ramp == Stop::disable) return enter(then);
    stopping_ = Stopping{ramp, then};
    modes_.begin_stop();
}

void DriveAxis::accept_controlword() noexcept {
    const std::uint16_t rising = control_.accept(values_.controlword);
    if ((rising & control::fault_reset) != 0 && state_ == State::fault) {
        if (faults_.reset()) {
            enter(State::switch_on_disabled);  // 15
        }
        return;
    }
    if (control_.has(control::fault_reset)) return;
    const Command command = command_of(control_.bits);
    switch (state_) {
    case State::switch_on_disabled:
        if (command == Command::shutdown && faults_.has_voltage()) {
            enter(State::ready_to_switch_on);  // 2
        }
        break;
    case State::ready_to_switch_on: command_ready(command); break;
    case State::switched_on: command_switched_on(command); break;
    case State::operation_enabled: command_enabled(command); break;
    case State::quick_stop_active: command_quick_stop(command); break;
    default: break;
    }
}

void DriveAxis::command_ready(Command command) noexcept {
    switch (command) {
    case Command::disable_voltage:
    case Command::quick_stop: return enter(State::switch_on_disabled);  // 7
    case Command::shutdown: break;
    case Command::switch_on:
    case Command::enable_operation:
        enter(State::switched_on);  // 3
        enable_next_ = command == Command::enable_operation;
        break;
    }
}

void DriveAxis::command_switched_on(Command command) noexcept {
    switch (command) {
    case Command::disable_voltage:
    case Command::quick_stop: return enter(State::switch_on_disabled);  // 10
    case Command::shutdown: return enter(State::ready_to_switch_on);  // 6
    case Command::switch_on: enable_next_ = false; break;
    case Command::enable_operation:
        if (!enable_next_) {
            enter(State::operation_enabled);  // 4
        }
        break;
    }
}

void DriveAxis::command_enabled(Command command) noexcept {
    if (command == Command::disable_voltage) return enter(State::switch_on_disabled);  // 9
    if (command == Command::quick_stop) return quick_stop();
    if (command == Command::enable_operation) return stay_enabled();
    const bool shutdown = command == Command::shutdown;
    const auto ramp =
        static_cast<Stop>(shutdown ? values_.shutdown_option : values_.disable_operation_option);
    const State then = shutdown ? State::ready_to_switch_on : State::switched_on;  // 8, 5
    if (stopping_ && ramp != Stop::disable) {
        stopping_->then = then;
    } else {
        stop_then(ramp, then);
    }
}

/// Transition 11.
void DriveAxis::quick_stop() noexcept {
    const int option = values_.quick_stop_option;
    const bool stays = option >= stay_in_quick_stop;
    state_ = State::quick_stop_active;
    restart_modes();
    stop_then(static_cast<Stop>(stays ? option - 4 : option),
              stays ? State::unknown : State::switch_on_disabled);
}

/// Cancels a stop for another transition.
void DriveAxis::stay_enabled() noexcept {
    if (!stopping_) return;
    stopping_.reset();
    restart_modes();
}

void DriveAxis::command_quick_stop(Command command) noexcept {
    if (command == Command::disable_voltage) return enter(State::switch_on_disabled);  // 12
    const bool may_return = values_.quick_stop_option >= stay_in_quick_stop;
    if (command != Command::enable_operation || !may_return) return;
    state_ = State::operation_enabled;  // 16
    stopping_.reset();
    restart_modes();
}

void DriveAxis::continue_transitions(double dt) noexcept {
    if (state_ == State::not_ready_to_switch_on) {
        enter(State::switch_on_disabled);  // 1
    }
    if (state_ == State::switched_on && enable_next_) {
        enter(State::operation_enabled);  // 4
    }
    if (state_ == State::fault_reaction_active && !stopping_) {
        enter(State::fault);  // 14
    }
    if (release_left_ > 0) {
        release_left_ -= dt;
    }
    if (engage_left_ > 0) {
        engage_left_ -= dt;
    }
}

void DriveAxis::lose_connection() noexcept {
    const bool on = state_ == State::switched_on || torque_on();
    const bool commanded = on || state_ == State::ready_to_switch_on;
    const auto option = static_cast<AbortConnection>(values_.abort_connection_option);
    if (commanded && option == AbortConnection::none) return;
    if (on && state_ != State::fault_reaction_active) {
        abort_connection(option);
    }
    if (state_ == State::ready_to_switch_on) {
        enter(State::switch_on_disabled);  // 7
    }
    // The next controlword is compared with 0, so that a fault reset that was held rises again.
    // Not a command: a stop on its ramp goes on.
    values_.controlword = 0;
    control_ = {};
    publish();
}

void DriveAxis::abort_connection(AbortConnection option) noexcept {
    switch (option) {
    case AbortConnection::none: return;
    case AbortConnection::fault: return raise(DriveFault::connection);
    case AbortConnection::disable_voltage: values_.controlword = command::disable_voltage; break;
    case AbortConnection::quick_stop: values_.controlword = command::quick_stop; break;
    }
    accept_controlword();
}

// The reference of a step.

void DriveAxis::make_reference(double dt) noexcept {
    train_.reference.start = train_.reference.motion.position;
    train_.reference.limited = false;
    const bool reaction_over = state_ == State::fault_reaction_active && !stopping_;
    if (!powered() || reaction_over) return train_.follow();
    if (release_left_ > 0) return modes_.hold();
    if (stopping_) return continue_stop(dt);
    if (state_ == State::operation_enabled) return modes_.step(dt);
    modes_.stand(dt);
}

void DriveAxis::continue_stop(double dt) noexcept {
    if (!modes_.step_stop(stopping_->ramp, dt)) return;
    if (stopping_->then == State::unknown) {
        stopping_.reset();
    } else {
        enter(stopping_->then);
    }
    modes_.end_stop();
    if (!powered()) {
        train_.follow();
    }
}

// Faults.

void DriveAxis::watch_causes() noexcept {
    const bool on = state_ == State::switched_on || torque_on();
    for (unsigned left = faults_.causes_present(); left != 0; left &= left - 1) {
        const auto cause = static_cast<DriveFault>(std::countr_zero(left));
        // Missing voltage is not a fault while the drive is off.
        if (cause == DriveFault::under_voltage && !on) continue;
        raise(cause);
    }
}

void DriveAxis::raise(DriveFault cause, std::int32_t detail) noexcept {
    const bool fresh = faults_.latch(cause, detail);
    if (state_ == State::fault) return;
    if (state_ != State::fault_reaction_active) return react(cause);
    if (fresh && !AxisFaults::controllable(cause)) {
        enter(State::fault);
    }
}

void DriveAxis::fail(std::uint16_t code) noexcept {
    if (state_ == State::fault || state_ == State::fault_reaction_active) return;
    faults_.set_device_code(code);
    raise(DriveFault::device);
}

/// Transition 13; if there is nothing to brake, or no way to, 14 follows with the next step.
void DriveAxis::react(DriveFault cause) noexcept {
    const bool had_torque = torque_on();
    const auto ramp = static_cast<Stop>(values_.fault_reaction_option);
    state_ = State::fault_reaction_active;
    stopping_.reset();
    enable_next_ = false;
    engage_left_ = release_left_ = 0;
    restart_modes();
    if (had_torque && AxisFaults::controllable(cause) && ramp != Stop::disable) {
        train_.follow();
        stop_then(ramp, State::fault);
    } else {
        train_.reference.control = Control::off;
    }
    publish();
}

// Values of the objects.

std::uint16_t DriveAxis::mode_bits() const noexcept {
    if (state_ == State::operation_enabled) return modes_.status_bits(monitor_.result());
    const bool stopped = state_ == State::quick_stop_active && !stopping_;
    return stopped ? status::target_reached : std::uint16_t{0};
}

bool DriveAxis::has_warning() const noexcept {
    const bool at_switch =
        (monitor_.inputs() & (input::negative_limit | input::positive_limit)) != 0;
    return modes_.record_lost() || train_.plant().heat() > warning_heat || at_switch;
}

std::uint16_t DriveAxis::statusword() const noexcept {
    unsigned word = states[static_cast<unsigned>(state_)].value | status::remote | mode_bits();
    if (faults_.has_voltage()) {
        word |= status::voltage_enabled;
    }
    const bool off = state_ == State::switch_on_disabled || state_ == State::fault ||
                     state_ == State::fault_reaction_active;
    if (off && control_.has(control::not_quick_stop)) {
        word |= status::not_quick_stop;
    }
    if (has_warning()) {
        word |= status::warning;
    }
    if (torque_on() && (train_.reference.limited || train_.saturated())) {
        word |= status::internal_limit;
    }
    return static_cast<std::uint16_t>(word);
}

void DriveAxis::publish() noexcept {
    const Plant& plant = train_.plant();
    const auto per_mille = [&](double torque) {
        return limited<std::int16_t>(torque / settings_.motor.rated_torque * 1000);
    };
    values_.statusword = statusword();
    publish_motion();
    values_.torque_demand = per_mille(train_.torque_demand());
    values_.torque_actual = values_.current_actual = per_mille(plant.torque());
    values_.dc_link = limited<std::uint32_t>(around_.dc_link * 1000);
    values_.inputs = monitor_.inputs();
    values_.buffer_position = static_cast<std::uint16_t>(modes_.records());
}

void DriveAxis::publish_motion() noexcept {
    auto& v = values_;
    const AxisScale& scale = train_.scale();
    const auto per_minute = [&](double increments) {
        return limited<std::int16_t>(increments * 60 / settings_.motor.resolution *
                                     ((v.polarity & 0x40) != 0 ? -1 : 1) *
                                     v.vl_dimension_denominator / v.vl_dimension_numerator *
                                     v.vl_set_point_denominator / v.vl_set_point_numerator);
    };
    const auto increments = [](double position) {
        return static_cast<std::int32_t>(whole(std::floor(position)));
    };
    const Reference& reference = train_.reference;
    const double speed = train_.speed();
    const double demand = reference.control == Control::off ? 0 : reference.motion.velocity;
    v.position_actual = scale.shown(train_.position());
    v.position_actual_internal = increments(train_.position());
    v.additional_position = increments(train_.plant().place());
    v.position_demand = scale.shown(reference.motion.position);
    v.position_demand_internal = static_cast<std::int32_t>(whole(reference.motion.position));
    v.following_error = limited<std::int32_t>(monitor_.following_error() / scale.position());
    v.velocity_actual = limited<std::int32_t>(speed / scale.velocity());
    v.velocity_sensor = limited<std::int32_t>(speed);
    v.velocity_demand = limited<std::int32_t>(demand / scale.velocity());
    v.control_effort = limited<std::int32_t>(train_.velocity_demand() / scale.velocity());
    v.vl_actual = per_minute(speed);
    v.vl_demand = per_minute(demand);
}

AxisStatus DriveAxis::status() const noexcept {
    const MotorSettings& motor = settings_.motor;
    const Plant& plant = train_.plant();
    return {.state = state_,
            .mode = modes_.mode(),
            .homed = modes_.homed(),
            .brake_closed = brake_closed(),
            .error_code = values_.error_code,
            .inputs = values_.inputs,
            .outputs = values_.outputs & values_.output_mask,
            .place = plant.place(),
            .speed = plant.speed() * 30 / std::numbers::pi,
            .torque = plant.torque(),
            .current = plant.torque() / motor.rated_torque * motor.rated_current};
}

// Writes of a master.

WriteCheck DriveAxis::check(std::uint16_t index,
                            std::span<const std::uint8_t> value) const noexcept {
    const unsigned number = value.size() > 1 ? value[0] | value[1] << 8 : value[0];
    if (!is_supported(index, number)) return WriteCheck::invalid_value;
    if (scales_set_points(index) && torque_on()) return WriteCheck::wrong_state;
    if (index == object::interpolation_data && modes_.records_full()) {
        return WriteCheck::buffer_full;
    }
    return WriteCheck::accepted;
}

bool DriveAxis::is_supported(std::uint16_t index, unsigned value) const noexcept {
    const auto signed_byte = static_cast<std::int8_t>(value);
    switch (index) {
    case object::modes_of_operation:
        return signed_byte == 0 ||
               (values_.supported_modes & bit_of(static_cast<Mode>(signed_byte))) != 0;
    case object::homing_method: return signed_byte == 0 || HomingSearch::supports(signed_byte);
    case object::motion_profile_type: return value == linear_ramps || value == jerk_limited;
    case object::torque_profile_type:
    case object::interpolation_submode: return value == linear_ramps;
    case object::profile_jerk_use: return value == 1;  // one jerk for all corners
    case object::touch_probe_function: return (value & reserved_touch_probe_bits) == 0;
    case object::positioning_option:
        return (value & reserved_positioning_bits) == 0 &&
               (value & relative_positioning_bits) != relative_positioning_bits;
    case object::polarity: return (value & reserved_polarity_bits) == 0;
    default: return true;
    }
}

/// Shows what the controlword changes at once. A word that is written in each cycle changes
/// nothing most of the time; the next step shows the rest.
void DriveAxis::command_written() noexcept {
    const State state = state_;
    const std::uint16_t bits = control_.bits;
    accept_controlword();
    if (state_ != state || control_.bits != bits) {
        publish();
    }
}

void DriveAxis::written(std::uint16_t index, std::uint8_t sub) noexcept {
    switch (index) {
    case object::controlword: command_written(); break;
    case object::target_position:
    case object::position_offset: modes_.set_point_written(Mode::cyclic_position); break;
    case object::target_velocity:
    case object::velocity_offset: modes_.set_point_written(Mode::cyclic_velocity); break;
    case object::target_torque:
    case object::torque_offset: modes_.set_point_written(Mode::cyclic_torque); break;
    case object::interpolation_data: modes_.record_written(); break;
    case object::interpolation_configuration:
        if (sub == 6 && values_.buffer_clear == 0) {
            modes_.clear_records();
        }
        break;
    default: break;
    }
}

}  // namespace hal::cia402
