// SPDX-License-Identifier: MIT
#include "cia402/drive/axis_faults.hpp"

#include <cmath>
#include <numbers>

namespace hal::cia402 {

namespace {

struct FaultRow {
    std::uint16_t code;
    bool controllable;
};
constexpr FaultRow fault_rows[AxisFaults::causes] = {
    {error::over_current, false},
    {error::over_voltage, true},
    {error::under_voltage, true},
    {error::over_temperature, true},
    {error::position_sensor, false},
    {error::over_speed, true},
    {error::heartbeat, true},
    {error::following_error, true},
    {0, true},  // its code is that of the device
};
constexpr const FaultRow& row_of(DriveFault cause) noexcept {
    return fault_rows[static_cast<unsigned>(cause)];
}

// Times the rated voltage, the heat of the rated torque, the highest speed.
constexpr double min_voltage = 0.7;
constexpr double max_voltage = 1.3;
constexpr double max_heat = 1.1;
constexpr double max_heat_at_reset = 1.0;
constexpr double max_speed = 1.2;

}  // namespace

std::uint16_t AxisFaults::code_of(DriveFault cause) const noexcept {
    return cause == DriveFault::device ? device_code_ : row_of(cause).code;
}

bool AxisFaults::controllable(DriveFault cause) noexcept { return row_of(cause).controllable; }

bool AxisFaults::has_voltage() const noexcept {
    return around_.dc_link >= min_voltage * train_.motor().rated_voltage;
}

bool AxisFaults::present(DriveFault cause) const noexcept {
    const auto simulated = [&](std::uint16_t bit) { return (values_.simulated_faults & bit) != 0; };
    const MotorSettings& motor = train_.motor();
    switch (cause) {
    case DriveFault::over_current:
        return simulated(simulated::over_current) ||
               train_.plant().heat() > (latched(cause) ? max_heat_at_reset : max_heat);
    case DriveFault::over_voltage:
        return simulated(simulated::over_voltage) ||
               around_.dc_link > max_voltage * motor.rated_voltage;
    case DriveFault::under_voltage: return simulated(simulated::under_voltage) || !has_voltage();
    case DriveFault::over_temperature: return simulated(simulated::over_temperature);
    case DriveFault::position_sensor:
        return simulated(simulated::encoder_broken) || around_.encoder_cut;
    case DriveFault::over_speed:
        return std::abs(train_.plant().speed()) >
               max_speed * motor.highest_speed * std::numbers::pi / 30;
    case DriveFault::connection: return bus_ != nullptr && !bus_->master_alive();
    case DriveFault::following_error:
    case DriveFault::device: return false;
    }
    return false;
}

bool AxisFaults::latch(DriveFault cause, std::int32_t detail) noexcept {
    if (latched(cause)) return false;
    latched_ = static_cast<std::uint16_t>(latched_ | 1U << static_cast<unsigned>(cause));
    values_.error_code = code_of(cause);
    if (bus_ != nullptr) {
        bus_->raise(code_of(cause), detail);
    }
    return true;
}

bool AxisFaults::reset() noexcept {
    for (unsigned n = 0; n < causes; ++n) {
        const auto cause = static_cast<DriveFault>(n);
        if (latched(cause) && present(cause)) return false;
    }
    for (unsigned n = 0; n < causes; ++n) {
        const auto cause = static_cast<DriveFault>(n);
        if (latched(cause) && bus_ != nullptr) {
            bus_->clear(code_of(cause));
        }
    }
    latched_ = 0;
    values_.error_code = 0;
    return true;
}

}  // namespace hal::cia402
