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
    if (cause == DriveFault::connection) return bus_ != nullptr && !bus_->master_alive();
    return (causes_present() >> static_cast<unsigned>(cause) & 1) != 0;
}

bool AxisFaults::is_simulated(std::uint16_t bit) const noexcept {
    return (values_.simulated_faults & bit) != 0;
}

bool AxisFaults::has_over_current() const noexcept {
    const double limit = latched(DriveFault::over_current) ? max_heat_at_reset : max_heat;
    return is_simulated(simulated::over_current) || train_.plant().heat() > limit;
}

bool AxisFaults::has_over_voltage() const noexcept {
    return is_simulated(simulated::over_voltage) ||
           around_.dc_link > max_voltage * train_.motor().rated_voltage;
}

bool AxisFaults::has_no_encoder() const noexcept {
    return is_simulated(simulated::encoder_broken) || around_.encoder_cut;
}

bool AxisFaults::is_too_fast() const noexcept {
    return std::abs(train_.plant().speed()) >
           max_speed * train_.motor().highest_speed * std::numbers::pi / 30;
}

std::uint16_t AxisFaults::causes_present() const noexcept {
    unsigned bits = 0;
    const auto watch = [&](DriveFault cause, bool is_present) {
        bits |= static_cast<unsigned>(is_present) << static_cast<unsigned>(cause);
    };
    watch(DriveFault::over_current, has_over_current());
    watch(DriveFault::over_voltage, has_over_voltage());
    watch(DriveFault::under_voltage, is_simulated(simulated::under_voltage) || !has_voltage());
    watch(DriveFault::over_temperature, is_simulated(simulated::over_temperature));
    watch(DriveFault::position_sensor, has_no_encoder());
    watch(DriveFault::over_speed, is_too_fast());
    return static_cast<std::uint16_t>(bits);
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
