// SPDX-License-Identifier: MIT
// One step of an axis: monitoring, touch probes, and the values of the objects.
#include "drive_axis.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hal::canopen::cia402 {

namespace {
template <class T>
T limited(double value) noexcept {
    return static_cast<T>(std::clamp<std::int64_t>(whole(value), std::numeric_limits<T>::min(),
                                                   std::numeric_limits<T>::max()));
}
}  // namespace

DriveAxis::DriveAxis(unsigned number, const AxisSettings& settings)
    : number_(number),
      settings_(possible(settings)),
      objects_(settings_),
      plant_(settings_.motor),
      dc_link_(settings_.motor.rated_voltage) {
    power_up();
}

void DriveAxis::attach(Device& device) {
    device_ = &device;
    each_object(objects_, [&](const ObjectRow& row, auto& value) {
        const auto index = of_axis(row.index, number_);
        device.dictionary().bind(index, row.sub, value);
        device.dictionary().handle(index, *this);
    });
}

void DriveAxis::power_up() noexcept {
    encoder_zero_ = std::floor(plant_.place());
    measured_ = plant_.place() - encoder_zero_;
    origin_ = 0;
    homed_ = false;
    state_ = State::not_ready_to_switch_on;
    control_ = edges_ = faults_ = 0;
    stopping_ = enable_next_ = false;
    release_left_ = engage_left_ = 0;
    mode_ = static_cast<Mode>(objects_.mode);
    objects_.mode_display = objects_.mode;
    probe_function_ = 0;
    probe_waits_ = {};
    following_ = speed_zero_ = slipping_ = saturated_ = false;
    follow();
    restart_mode();
    read_units();
    publish();
}

void DriveAxis::step(double dt) noexcept {
    read_units();
    go_on_with_state(dt);
    watch_causes();
    select_mode();
    make_reference(dt);
    const double torque = servo(dt);
    plant_.step(dt, torque, load_ + objects_.load_torque / 1000.0, brake_closed());
    if (!present(Cause::position_sensor)) {
        measured_ = plant_.place() - encoder_zero_;
    }
    if (loop_ == Control::velocity || loop_ == Control::torque) {
        ref_.position = measured_;
    }
    monitor(dt);
    watch_probes();
    publish();
}

bool DriveAxis::brake_closed() const noexcept {
    if (!(settings_.motor.brake_torque > 0)) return false;
    if ((objects_.output_mask & objects_.outputs & output::set_brake) != 0) return true;
    return torque_state() ? release_left_ > 0 : engage_left_ <= 0;
}

void DriveAxis::monitor(double dt) noexcept {
    const double error = loop_ == Control::position ? ref_.position - measured_ : 0;
    const auto window = objects_.following_error_window;
    following_ = torque_state() && window != no_window &&
                 std::abs(error) > window * std::abs(units_.position);
    following_time_ = following_ ? following_time_ + dt : 0;
    if (following_ && following_time_ * 1000 >= objects_.following_error_timeout) {
        raise(Cause::following_error, limited<std::int32_t>(error / units_.position));
    }

    const bool slow =
        std::abs(now_speed()) < std::max(1.0, objects_.velocity_threshold * units_.speed);
    speed_zero_time_ = slow ? speed_zero_time_ + dt : 0;
    speed_zero_ = slow && speed_zero_time_ * 1000 >= objects_.velocity_threshold_time;
    slipping_ = objects_.max_slippage > 0 && loop_ == Control::velocity &&
                std::abs(ref_.velocity - now_speed()) > objects_.max_slippage * units_.speed;

    const auto place = plant_.place();
    inputs_before_ = inputs_;
    inputs_ = external_inputs_;
    if (plant_.negative_limit().holds(place)) {
        inputs_ |= input::negative_limit;
    }
    if (plant_.positive_limit().holds(place)) {
        inputs_ |= input::positive_limit;
    }
    if (plant_.home().holds(place)) {
        inputs_ |= input::home;
    }
    for (unsigned n = 0; n < 2; ++n) {
        if (plant_.probe(n).holds(place)) {
            inputs_ |= input::probe_1 << n;
        }
    }
}

// Touch probes: function and status of probe 2 are 8 places further up.

void DriveAxis::watch_probes() noexcept {
    for (unsigned n = 0; n < 2; ++n) {
        const unsigned shift = 8 * n;
        auto status = static_cast<std::uint8_t>(objects_.probe_status >> shift);
        watch_probe(n, objects_.probe_function >> shift & 0xff, probe_function_ >> shift & 0xff,
                    status);
        objects_.probe_status = static_cast<std::uint16_t>(
            (objects_.probe_status & ~(0xff << shift)) | status << shift);
    }
    probe_function_ = objects_.probe_function;
}

std::optional<double> DriveAxis::probed(unsigned n, bool rising, bool index) const noexcept {
    if (index) return plant_.index_pulse();
    const auto mounted = plant_.probe(n);
    if (const auto place = mounted.edge(plant_.before(), plant_.place(), rising)) return place;
    // An external input latches the position at which it is sampled.
    const auto bit = input::probe_1 << n;
    const bool changed =
        ((inputs_ ^ inputs_before_) & bit) != 0 && ((inputs_ & bit) != 0) == rising;
    return changed && mounted.holds(plant_.place()) == mounted.holds(plant_.before())
               ? std::optional(plant_.place())
               : std::nullopt;
}

void DriveAxis::watch_probe(unsigned n, unsigned function, unsigned before,
                            std::uint8_t& status) noexcept {
    using namespace probe;
    auto& waits = probe_waits_[n];
    if ((function & enable) == 0) {
        status = 0;
        waits = 0;
        return;
    }
    // Requesting an edge again arms it; a captured edge rearms only in continuous mode.
    const unsigned asked = function & (positive_edge | negative_edge);
    const bool afresh =
        (before & enable) == 0 || ((function ^ before) & (continuous | index_pulse)) != 0;
    const unsigned anew = afresh ? asked : asked & ~before;
    waits = static_cast<std::uint8_t>((waits & asked) | anew);
    if ((anew & positive_edge) != 0 || (before & enable) == 0) {
        status &= static_cast<std::uint8_t>(~positive_stored);
    }
    if ((anew & negative_edge) != 0 || (before & enable) == 0) {
        status &= static_cast<std::uint8_t>(~negative_stored);
    }
    status |= enabled;
    for (const bool rising : {true, false}) {
        const unsigned edge = rising ? positive_edge : negative_edge;
        if ((asked & edge) == 0 || ((function & continuous) == 0 && (waits & edge) == 0)) continue;
        const auto place = probed(n, rising, (function & index_pulse) != 0);
        if (!place) continue;
        objects_.probe_positions[2 * n + (rising ? 0 : 1)] = shown(*place - encoder_zero_);
        waits = static_cast<std::uint8_t>(waits & ~edge);
        status = static_cast<std::uint8_t>((status | (rising ? positive_stored : negative_stored)) ^
                                           updated);
    }
}

// Values of the objects.

std::uint16_t DriveAxis::mode_bits() const noexcept {
    using namespace status;
    if (state_ != State::operation_enabled) {
        return state_ == State::quick_stop_active && !stopping_ ? target_reached : 0;
    }
    const auto when = [](bool on, std::uint16_t bit) { return on ? bit : std::uint16_t{0}; };
    unsigned bits = 0;
    const bool idle = !active_ && ref_.velocity == 0 && standing();
    switch (mode_) {
    case Mode::profile_position:
        // For a set of set-points the last one counts.
        bits = when(active_ ? reached_ && set_points_.count == 0 : idle, target_reached) |
               when(acknowledged_, set_point_acknowledge) | when(following_, following_error);
        break;
    case Mode::velocity: break;
    case Mode::profile_velocity:
        bits = when(reached_, target_reached) | when(speed_zero_, speed_is_zero) |
               when(slipping_, max_slippage);
        break;
    case Mode::profile_torque: bits = when(reached_, target_reached); break;
    case Mode::homing:
        bits = when(reached_, target_reached) |
               when(homing_phase_ == HomingPhase::back || homing_phase_ == HomingPhase::done,
                    homing_attained) |
               when(homing_phase_ == HomingPhase::error, homing_error);
        break;
    case Mode::interpolated_position:
        bits = when(reached_, target_reached) | when(active_, interpolation_active);
        break;
    case Mode::cyclic_position:
        bits =
            when(has_target_ && guard_ == 0, follows_command) | when(following_, following_error);
        break;
    case Mode::cyclic_velocity:
    case Mode::cyclic_torque: bits = when(has_target_ && guard_ == 0, follows_command); break;
    case Mode::none: break;
    }
    if (halted_ && !cyclic()) {
        bits &= ~unsigned{target_reached};
        bits |= when(still_time_ > 0, target_reached);
    }
    return static_cast<std::uint16_t>(bits);
}

void DriveAxis::publish() noexcept {
    auto& o = objects_;
    unsigned word = states[static_cast<unsigned>(state_)].value;
    if (dc_link_ >= 0.7 * settings_.motor.rated_voltage) {
        word |= status::voltage_enabled;
    }
    if (state_ == State::switch_on_disabled || state_ == State::fault ||
        state_ == State::fault_reaction_active) {
        word |= (control_ & control::not_quick_stop) != 0 ? status::not_quick_stop : 0;
    }
    word |= status::remote;
    if (record_lost_ || plant_.heat() > 0.9 ||
        (inputs_ & (input::negative_limit | input::positive_limit)) != 0) {
        word |= status::warning;
    }
    if (torque_state() && (limited_ || saturated_)) {
        word |= status::internal_limit;
    }
    o.statusword = static_cast<std::uint16_t>(word | mode_bits());

    const auto per_mille = [&](double torque) {
        return limited<std::int16_t>(torque / settings_.motor.rated_torque * 1000);
    };
    const auto per_minute = [&](double increments) {
        return limited<std::int16_t>(increments * 60 / settings_.motor.resolution *
                                     ((o.polarity & 0x40) != 0 ? -1 : 1) *
                                     o.vl_dimension_denominator / o.vl_dimension_numerator *
                                     o.vl_set_point_denominator / o.vl_set_point_numerator);
    };
    const double speed = now_speed();
    o.position_actual = shown(measured_);
    o.position_actual_internal = static_cast<std::int32_t>(whole(std::floor(measured_)));
    o.additional_position = static_cast<std::int32_t>(whole(std::floor(plant_.place())));
    o.position_demand = shown(ref_.position);
    o.position_demand_internal = static_cast<std::int32_t>(whole(ref_.position));
    o.following_error = loop_ == Control::position
                            ? limited<std::int32_t>((ref_.position - measured_) / units_.position)
                            : 0;
    o.velocity_actual = limited<std::int32_t>(speed / units_.velocity);
    o.velocity_sensor = limited<std::int32_t>(speed);
    o.velocity_demand =
        limited<std::int32_t>((loop_ == Control::off ? 0 : ref_.velocity) / units_.velocity);
    o.control_effort = limited<std::int32_t>(velocity_wanted_ / units_.velocity);
    o.vl_actual = per_minute(speed);
    o.vl_demand = per_minute(loop_ == Control::off ? 0 : ref_.velocity);
    o.torque_demand = per_mille(torque_demand_);
    o.torque_actual = o.current_actual = per_mille(plant_.torque());
    o.dc_link = limited<std::uint32_t>(dc_link_ * 1000);
    o.inputs = inputs_;
    o.buffer_position = static_cast<std::uint16_t>(records_.count);
}

AxisStatus DriveAxis::status() const noexcept {
    const auto& m = settings_.motor;
    return {.state = state_,
            .mode = mode_,
            .homed = homed_,
            .brake_closed = brake_closed(),
            .error_code = objects_.error_code,
            .inputs = objects_.inputs,
            .outputs = objects_.outputs & objects_.output_mask,
            .place = plant_.place(),
            .speed = plant_.speed() * 30 / std::numbers::pi,
            .torque = plant_.torque(),
            .current = plant_.torque() / m.rated_torque * m.rated_current};
}

// Writes of a master.

Abort DriveAxis::writing(Entry& e, std::span<const std::uint8_t> value) noexcept {
    const auto byte = static_cast<std::int8_t>(value[0]);
    switch (of_first_axis(e.index)) {
    case object::modes_of_operation:
        return byte == 0 || (byte > 0 &&
                             (objects_.supported_modes & bit_of(static_cast<Mode>(byte))) != 0)
                   ? Abort::none
                   : Abort::value;
    case object::homing_method:
        return byte == 0 || HomingSearch::supports(byte) ? Abort::none : Abort::value;
    case object::motion_profile_type: {
        const auto type = load<std::int16_t>(value.data());
        return type == linear_ramps || type == jerk_limited ? Abort::none : Abort::value;
    }
    // one jerk for all corners
    case object::profile_jerk_use: return value[0] == 1 ? Abort::none : Abort::value;
    case object::torque_profile_type:
    // linear only
    case object::interpolation_submode:
        return load<std::int16_t>(value.data()) == 0 ? Abort::none : Abort::value;
    case object::touch_probe_function:
        return (value[0] & 0xc8) != 0 || (value[1] & 0xc8) != 0 ? Abort::value : Abort::none;
    case object::positioning_option:
        return (value[0] & 0x3c) != 0 || (value[0] & 3) == 3 || value[1] != 0 ? Abort::value
                                                                              : Abort::none;
    case object::interpolation_data:
        return records_.full(objects_.buffer_size) ? Abort::no_resource : Abort::none;
    case object::polarity:
        if ((value[0] & 0x3f) != 0) return Abort::value;
        [[fallthrough]];
    case object::position_encoder_resolution:
    case object::gear_ratio:
    case object::feed_constant:
    case object::velocity_factor:
    case object::acceleration_factor:
        // the unit of the set-point would change
        return torque_state() ? Abort::device_state : Abort::none;
    default: return Abort::none;
    }
}

void DriveAxis::written(Entry& e) noexcept {
    switch (e.index < 0x6000 ? 0 : of_first_axis(e.index)) {
    case object::controlword:
        take_controlword();
        publish();
        break;
    case object::target_position:
    case object::position_offset: fresh_ = fresh_ || mode_ == Mode::cyclic_position; break;
    case object::target_velocity:
    case object::velocity_offset: fresh_ = fresh_ || mode_ == Mode::cyclic_velocity; break;
    case object::target_torque:
    case object::torque_offset: fresh_ = fresh_ || mode_ == Mode::cyclic_torque; break;
    case object::interpolation_data:
        if (mode_ != Mode::interpolated_position) break;
        // by a PDO; an SDO is rejected
        if (records_.full(objects_.buffer_size)) {
            record_lost_ = true;
        } else {
            records_.push(objects_.interpolation_record);
        }
        break;
    case object::interpolation_configuration:
        if (e.sub == 6 && objects_.buffer_clear == 0) {
            records_.clear();
            record_lost_ = false;
        }
        break;
    default: break;
    }
}

}  // namespace hal::canopen::cia402
