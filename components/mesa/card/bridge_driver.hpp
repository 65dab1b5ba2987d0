// SPDX-License-Identifier: MIT
// A three-phase PWM generator of an emulated card.
#pragma once

#include <cstdint>

#include "mesa/hostmot2/formulas.hpp"
#include "mesa/hostmot2/pin.hpp"
#include "mesa/hostmot2/registers.hpp"

namespace hal::mesa {

/// Six gates and an enable output. While the fault input is active, the enable bit is 0 and the fault
/// bit 1; the fault bit stays until the register is written. [realtime]
class BridgeDriver {
public:
    std::uint32_t value = 0, setup = 0;

    void write_enable(std::uint32_t bits) noexcept {
        enable_ = bits & (three_phase_pwm::is_enabled | three_phase_pwm::has_fault);
    }
    std::uint32_t enable() const noexcept { return enable_; }
    /// `level`: that of the fault input.
    void sample(bool level) noexcept {
        const bool is_active_high = (setup & three_phase_pwm::fault_on_high) != 0;
        if (level != is_active_high) return;
        enable_ = three_phase_pwm::has_fault;
    }
    /// Returns the level of an output; of a gate that it is on for more than half of the time.
    bool level(unsigned number) const noexcept {
        namespace pins = pin_number::three_phase_pwm;
        const bool is_on = (enable_ & three_phase_pwm::is_enabled) != 0;
        if (number == pins::enable) return !is_on;  // active low
        const bool is_inverted = number >= pins::first_inverted;
        const unsigned phase = number - (is_inverted ? pins::first_inverted : pins::a);
        const bool is_high = three_phase_duty(value, phase) > 0.0;
        return is_on && is_high != is_inverted;
    }

private:
    std::uint32_t enable_ = 0;
};

}  // namespace hal::mesa
