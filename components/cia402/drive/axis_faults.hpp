// SPDX-License-Identifier: MIT
// The faults of an axis: which causes are present, and which are latched until a reset.
#pragma once

#include "cia402/drive/drivetrain.hpp"

namespace hal::cia402 {

enum class DriveFault : std::uint8_t {
    over_current,
    over_voltage,
    under_voltage,
    over_temperature,
    position_sensor,
    over_speed,
    connection,
    following_error,
    device,  ///< one that the maker of the drive defines
};

/// The bus of an axis: it reports faults to the master. [realtime]
class AxisBus {
public:
    virtual ~AxisBus() = default;
    /// Reports a fault with its code (603Fh); `detail` is the following error in user units.
    virtual void raise(std::uint16_t code, std::int32_t detail) noexcept = 0;
    /// Reports that the fault with this code is gone.
    virtual void clear(std::uint16_t code) noexcept = 0;
    /// Returns true when no supervised node is missing.
    virtual bool master_alive() const noexcept = 0;
};

/// What acts on the drive from outside.
struct Surroundings {
    double load = 0;  ///< N·m
    double dc_link = 0;  ///< V
    std::uint32_t inputs = 0;  ///< of 60FDh
    bool encoder_cut = false;
};

/// The faults. [realtime]
class AxisFaults {
public:
    static constexpr unsigned causes = 9;

    /// All must outlive it. [setup]
    AxisFaults(const Drivetrain& train, AxisValues& values, const Surroundings& around) noexcept
        : train_(train), values_(values), around_(around) {}

    void connect(AxisBus& bus) noexcept { bus_ = &bus; }  ///< [setup]
    void power_up() noexcept { latched_ = 0; }
    /// Sets the code of the next DriveFault::device.
    void set_device_code(std::uint16_t code) noexcept { device_code_ = code; }
    bool present(DriveFault) const noexcept;
    /// Returns a bit for each cause that is present, of those that the faults see by themselves:
    /// not the connection and the following error.
    std::uint16_t causes_present() const noexcept;
    bool has_voltage() const noexcept;
    bool has_no_encoder() const noexcept;
    /// Returns true when the motor can still be braked by a ramp.
    static bool controllable(DriveFault) noexcept;
    /// Latches and reports a cause; 603Fh shows the last one. Returns false when it is latched
    /// already.
    bool latch(DriveFault, std::int32_t detail) noexcept;
    /// Clears all causes. Returns false when one of them is still present.
    bool reset() noexcept;

private:
    bool is_simulated(std::uint16_t bit) const noexcept;
    bool has_over_current() const noexcept;
    bool has_over_voltage() const noexcept;
    bool is_too_fast() const noexcept;
    std::uint16_t code_of(DriveFault) const noexcept;
    bool latched(DriveFault cause) const noexcept {
        return (latched_ >> static_cast<unsigned>(cause) & 1) != 0;
    }

    const Drivetrain& train_;
    AxisValues& values_;
    const Surroundings& around_;
    AxisBus* bus_ = nullptr;
    std::uint16_t latched_ = 0;  // a bit for each DriveFault
    std::uint16_t device_code_ = 0;
};

}  // namespace hal::cia402
