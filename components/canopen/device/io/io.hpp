// SPDX-License-Identifier: MIT
// A device of CiA 401: terminals on one side, objects 6000h..64FFh on the other.
#pragma once

#include <array>
#include <cstdint>

#include "canopen/device/program.hpp"

namespace hal::canopen {

struct IoSettings {
    unsigned digital_inputs = 64;
    unsigned digital_outputs = 64;  ///< 0..64
    unsigned analog_inputs = 12;
    unsigned analog_outputs = 12;    ///< 0..12
    std::uint32_t serial = 1;
    std::uint16_t heartbeat_ms = 0;
};

/// Returns the objects and default PDOs of the device (CiA 401). Throws std::invalid_argument for
/// too many terminals. [setup]
Description io_description(const IoSettings&);

/// The device. Outputs take their error values when it is stopped, on a communication error and on
/// bus off, until they are written again.
class Io final : public Program {
public:
    explicit Io(const IoSettings& = {});  // [setup]

    // Terminals, counted from 0; an invalid number is ignored. [realtime]
    void set_input(unsigned n, bool on) noexcept;
    bool output(unsigned n) const noexcept {
        return n < settings_.digital_outputs && (terminals_out_[n / 8] >> n % 8 & 1) != 0;
    }
    /// Sets an input to -1..1 of its range.
    void set_analog_input(unsigned n, double fraction) noexcept;
    double analog_output(unsigned n) const noexcept {
        return n < settings_.analog_outputs ? analog_out_[n] / 32767.0 : 0.0;
    }
    /// Returns true while outputs are at their error values and have not been written since.
    /// [realtime]
    bool safe() const noexcept { return safe_; }

    Description description() const override { return io_description(settings_); }
    void attach(Device&) override;
    void step(Time now) noexcept override { sample(now); }
    bool set(std::string_view name, double value) override;
    std::vector<std::string> settable() const override;
    std::string summary() const override;

    void on_sync(std::uint8_t, Time now) noexcept override { sample(now); }
    void on_state(NmtState state) noexcept override {
        if (state == NmtState::stopped) {
            take_error_values();
        }
    }
    void on_communication_error(Time) noexcept override { take_error_values(); }
    void on_reset(bool application) noexcept override;
    Abort reading(Entry&) noexcept override;
    void written(Entry&) noexcept override;

private:
    static constexpr unsigned max_bits = 64;

private:
    static constexpr unsigned max_analog = 12;

private:
    static constexpr unsigned bytes = max_bits / 8;
    using Block = std::array<std::uint8_t, bytes>;

    void sample(Time now) noexcept;
    void sample_digital(Time now) noexcept;
    void sample_analog() noexcept;
    bool interrupts(unsigned n, std::int32_t value) const noexcept;
    void trigger(std::uint16_t index, std::size_t sub) noexcept;
    void drive_outputs() noexcept;
    void take_error_values() noexcept;
    void lay(std::uint16_t index, void* image, std::size_t each);

    const IoSettings settings_;
    // Values of the objects, and of the terminals.
    alignas(8) Block inputs_{}, outputs_{}, input_polarity_{}, filter_{}, any_change_{}, rising_{},
        falling_{}, output_polarity_{}, error_mode_{}, error_value_{}, output_mask_{};
    Block terminals_in_{};
    Block terminals_out_{};
    Block filtered_{};
    std::array<Time, max_bits> differs_since_{};
    std::array<std::int16_t, max_analog> analog_in_{}, analog_out_{}, analog_terminals_{};
    std::array<std::int32_t, max_analog> upper_{}, lower_{}, error_analog_{}, sent_{};
    std::array<std::uint32_t, max_analog> delta_{}, negative_delta_{}, positive_delta_{};
    std::array<std::uint8_t, max_analog> triggers_{}, analog_error_mode_{};
    std::uint8_t interrupts_on_ = 1;
    std::uint8_t analog_interrupts_on_ = 0;
    std::uint16_t filter_ms_ = 10;
    std::uint32_t interrupted_ = 0;
    bool safe_ = false;
};

}  // namespace hal::canopen
