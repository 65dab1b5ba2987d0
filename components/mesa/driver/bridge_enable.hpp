// SPDX-License-Identifier: MIT
// The enable register of three-phase PWM.
#pragma once

#include <cstdint>
#include <optional>

#include "mesa/hostmot2/registers.hpp"

namespace hal::mesa {

/// A fault input of the card clears the enable bit and sets the fault bit, within some 70 ns. A write
/// sets both, so writing the enable bit again would clear a fault that nobody has seen, and switch on
/// a bridge with a short circuit. The bit is therefore written behind an answer that shows it cleared,
/// and after a fault not before the command was FALSE. Used by one thread; all functions are
/// [realtime].
class BridgeEnable {
public:
    /// Follows an answer that shows the register.
    void receive(std::uint32_t enable, bool writes_arrived) noexcept {
        shown_ = enable;
        is_read_ = true;
        if (has_sent_ && writes_arrived) {
            may_clear_fault_ = false;
        }
        has_sent_ = false;
        const bool has_fault = (enable & three_phase_pwm::has_fault) != 0;
        is_tripped_ = is_tripped_ || (has_fault && !may_clear_fault_);
    }
    /// Returns whether a fault keeps the bridge off.
    bool is_tripped() const noexcept { return is_tripped_; }
    /// Returns the value to write; nothing: the register stays. `command`: the bridge is to be on;
    /// `outputs_on`: outputs of the card may be.
    std::optional<std::uint32_t> transmit(bool command, bool outputs_on) noexcept {
        if (!command) {
            is_tripped_ = false;
            may_clear_fault_ = true;
        }
        const bool is_enabled = (shown_ & three_phase_pwm::is_enabled) != 0;
        const bool is_known = is_read_;
        is_read_ = false;
        if (command && outputs_on && !is_tripped_) {
            if (!is_known || is_enabled) return {};
            has_sent_ = true;
            return three_phase_pwm::is_enabled;
        }
        if (is_known && !is_enabled) return {};
        return 0;
    }

private:
    std::uint32_t shown_ = 0;
    bool is_read_ = false;  ///< in this cycle
    bool has_sent_ = false;  ///< the enable bit, since the newest answer
    bool may_clear_fault_ = true;  ///< the command was FALSE since the last fault
    bool is_tripped_ = false;  ///< off until the command is FALSE
};

}  // namespace hal::mesa
