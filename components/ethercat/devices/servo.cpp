// SPDX-License-Identifier: MIT
#include "ethercat/devices/servo.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "cia301/error_register.hpp"
#include "cia402/drive/axis_objects.hpp"

namespace hal::ethercat::devices {

namespace o402 = cia402::object;

namespace {

constexpr double max_step = 0.001;  // s, of the axis
constexpr double max_gap = 0.1;     // s; after a longer one the motor has not moved

}  // namespace

ServoAxis::ServoAxis(Dictionary& dictionary, unsigned number, const cia402::AxisSettings& settings)
    : number_(number),
      rated_voltage_(settings.motor.rated_voltage),
      axis_(settings),
      dc_link_(rated_voltage_) {
    cia402::each_object(axis_.values(), [&](const cia402::ObjectRow& row, auto& value) {
        dictionary.bind(cia402::of_axis(row.index, number), row.sub, value);
    });
    axis_.connect(*this);
}

void ServoAxis::power_on() noexcept {
    pending_ = {};
    register_bits_ = 0;
    faults_ = 0;
    outputs_valid_ = false;
    command_waits_ = false;
    axis_.power_up();
    copy_surroundings();
    axis_.step(max_step);  // the self-test: switch on disabled, which SDOs read before SAFE-OP
    show(false);
}

coe::Abort ServoAxis::check(std::uint16_t index,
                            std::span<const std::uint8_t> value) const noexcept {
    switch (axis_.check(cia402::of_first_axis(index), value)) {
    case cia402::WriteCheck::accepted: return coe::Abort::none;
    case cia402::WriteCheck::invalid_value: return coe::Abort::value;
    case cia402::WriteCheck::wrong_state: return coe::Abort::device_state;
    case cia402::WriteCheck::buffer_full: return coe::Abort::no_resource;
    }
    return coe::Abort::none;
}

void ServoAxis::written(std::uint16_t index, std::uint8_t sub) noexcept {
    const std::uint16_t object = cia402::of_first_axis(index);
    // Without valid outputs nobody commands the drive. The first outputs are written before the
    // step that has them.
    if (object == o402::controlword && !outputs_valid_) {
        command_waits_ = true;
        return;
    }
    axis_.written(object, sub);
}

/// An emergency has the axis in its first byte, then the detail, as that of a CANopen drive.
void ServoAxis::raise(std::uint16_t code, std::int32_t detail) noexcept {
    register_bits_ |= cia301::register_bit_of(code);
    ++faults_;
    coe::Emergency emergency;
    emergency.code = code;
    emergency.error_register = error_register();
    emergency.data[0] = static_cast<std::uint8_t>(number_);
    put(emergency.data + 1, detail);
    pending_.push(emergency);
}

std::uint8_t ServoAxis::error_register() const noexcept {
    if (faults_ == 0) return 0;
    return static_cast<std::uint8_t>(register_bits_ | cia301::error_generic);
}

/// When the last fault is over, an emergency with code 0 reports it.
void ServoAxis::clear(std::uint16_t) noexcept {
    if (faults_ == 0 || --faults_ != 0) return;
    register_bits_ = 0;
    pending_.push({});
}

void ServoAxis::copy_surroundings() noexcept {
    axis_.set_inputs(inputs_.load(std::memory_order_relaxed));
    axis_.set_load_torque(load_torque_.load(std::memory_order_relaxed));
    axis_.set_dc_link(dc_link_.load(std::memory_order_relaxed));
    axis_.set_encoder_broken(encoder_broken_.load(std::memory_order_relaxed));
}

/// Takes the cycle of SYNC0 as the time between two set-points, 60C2h.
void ServoAxis::follow_sync_cycle(std::int64_t cycle_ns) noexcept {
    if (cycle_ns <= 0) return;
    if (cycle_ns != sync_cycle_ns_) {
        set_sync_cycle(cycle_ns);
    }
    axis_.values().interpolation_period = period_;
    axis_.values().interpolation_exponent = exponent_;
}

void ServoAxis::set_sync_cycle(std::int64_t cycle_ns) noexcept {
    std::int64_t unit = 1'000'000;
    int exponent = -3;
    while (exponent > -6 && (cycle_ns % unit != 0 || cycle_ns / unit > 255)) {
        unit /= 10;
        --exponent;
    }
    const auto periods = std::clamp<std::int64_t>((cycle_ns + unit / 2) / unit, 1, 255);
    sync_cycle_ns_ = cycle_ns;
    period_ = static_cast<std::uint8_t>(periods);
    exponent_ = static_cast<std::int8_t>(exponent);
}

/// Divides a time into steps that the axis can make, s.
template <class Advance>
void ServoAxis::in_steps(std::int64_t dt_ns, Advance advance) noexcept {
    if (dt_ns <= 0) return;
    const double dt = std::min(static_cast<double>(dt_ns) * 1e-9, max_gap);
    const int steps = std::max(1, static_cast<int>(std::ceil(dt / max_step * (1 - 1e-9))));
    for (int n = 0; n < steps; ++n) {
        advance(dt / steps);
    }
}

void ServoAxis::power_off() noexcept {
    outputs_valid_ = false;
    axis_.power_down();
    show(false);
}

void ServoAxis::rest(std::int64_t dt_ns) noexcept {
    copy_surroundings();
    if (!axis_.moves()) return;
    in_steps(dt_ns, [this](double dt) noexcept { axis_.coast(dt); });
    show(false);
}

void ServoAxis::step(Step& step) noexcept {
    copy_surroundings();
    follow_sync_cycle(step.sync_cycle_ns);
    if (const auto code = fault_request_.exchange(0, std::memory_order_relaxed)) {
        axis_.fail(code);
    }
    const bool lost = outputs_valid_ && !step.outputs_valid;
    outputs_valid_ = step.outputs_valid;
    if (lost) {
        axis_.lose_connection();
    }
    if (outputs_valid_ && std::exchange(command_waits_, false)) {
        axis_.written(o402::controlword, 0);
    }
    in_steps(step.dt_ns, [this](double dt) noexcept { axis_.step(dt); });
    step.emergencies.append(pending_);
    pending_ = {};
    show(step.outputs_valid);
}

void ServoAxis::show(bool outputs_valid) noexcept {
    const cia402::AxisValues& values = axis_.values();
    const cia402::AxisStatus status = axis_.status();
    shown_position_.store(values.position_actual, std::memory_order_relaxed);
    shown_velocity_.store(values.velocity_actual, std::memory_order_relaxed);
    shown_torque_.store(status.torque, std::memory_order_relaxed);
    shown_status_.store(values.statusword, std::memory_order_relaxed);
    shown_homed_.store(status.homed, std::memory_order_relaxed);
    shown_brake_.store(status.brake_closed, std::memory_order_relaxed);
    outputs_.store(outputs_valid ? status.outputs : 0, std::memory_order_relaxed);
}

Servo::Servo(std::shared_ptr<Dictionary> dictionary, unsigned axes,
             const cia402::AxisSettings& settings)
    : dictionary_(std::move(dictionary)), error_register_(dictionary_->at(0x1001, 0)) {
    for (unsigned n = 0; n < axes; ++n) {
        axes_.push_back(std::make_unique<ServoAxis>(*dictionary_, n, settings));
    }
}

ServoAxis* Servo::axis_with(std::uint16_t index) const noexcept {
    const unsigned number = cia402::axis_of(index);
    const bool of_an_axis = index >= 0x6000 && number < axes_.size();
    return of_an_axis ? axes_[number].get() : nullptr;
}

coe::Abort Servo::check(std::uint16_t index, std::uint8_t,
                        std::span<const std::uint8_t> value) noexcept {
    const ServoAxis* axis = axis_with(index);
    return axis != nullptr ? axis->check(index, value) : coe::Abort::none;
}

void Servo::written(std::uint16_t index, std::uint8_t sub) noexcept {
    if (ServoAxis* axis = axis_with(index)) {
        axis->written(index, sub);
    }
}

void Servo::power_on() noexcept {
    for (auto& axis : axes_) {
        axis->power_on();
    }
}

void Servo::power_off() noexcept {
    for (auto& axis : axes_) {
        axis->power_off();
    }
}

void Servo::rest(std::int64_t dt_ns) noexcept {
    for (auto& axis : axes_) {
        axis->rest(dt_ns);
    }
}

bool Servo::moves() const noexcept {
    return std::any_of(axes_.begin(), axes_.end(), [](const auto& axis) { return axis->moves(); });
}

void Servo::step(Step& step) noexcept {
    *error_register_ = 0;
    for (auto& axis : axes_) {
        axis->step(step);
        *error_register_ |= axis->error_register();
    }
}

}  // namespace hal::ethercat::devices
