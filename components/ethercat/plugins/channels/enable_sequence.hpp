// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

namespace hal::ethercat {

namespace statusword {
constexpr std::uint16_t ready_to_switch_on = 0x0001;
constexpr std::uint16_t switched_on = 0x0002;
constexpr std::uint16_t operation_enabled = 0x0004;
constexpr std::uint16_t fault = 0x0008;
constexpr std::uint16_t switch_on_disabled = 0x0040;
}  // namespace statusword

namespace controlword {
constexpr std::uint16_t switch_on = 0x0001;
constexpr std::uint16_t enable_voltage = 0x0002;
constexpr std::uint16_t quick_stop = 0x0004;  ///< 0: stops
constexpr std::uint16_t enable_operation = 0x0008;
constexpr std::uint16_t ramp = 0x0070;  ///< velocity mode: the ramp runs to its target
constexpr std::uint16_t fault_reset = 0x0080;
constexpr std::uint16_t halt = 0x0100;
}  // namespace controlword

/// Takes a drive of CiA 402 through its states by one pin `enable`. The rising edge of `enable`
/// resets a fault, which is then not shown for 100 ms.
class EnableSequence {
public:
    /// Returns the control word for a status word, without `halt` and `ramp`. [realtime]
    std::uint16_t control(std::uint16_t status, bool enable, bool reset,
                          bool resets_itself) noexcept {
        const bool rose = enable && !last_enable_;
        last_enable_ = enable;
        std::uint16_t word = controlword::quick_stop;
        if ((status & statusword::fault) != 0) {
            const bool own_reset = rose && resets_itself;
            if (own_reset) {
                hidden_ns_ = hidden_for_ns;
            }
            if (own_reset || reset) {
                word |= controlword::fault_reset;
            }
            return word;
        }
        if (!enable) return word;
        word |= controlword::enable_voltage;
        if ((status & statusword::ready_to_switch_on) == 0) return word;
        word |= controlword::switch_on;
        if ((status & statusword::switched_on) == 0) return word;
        word |= controlword::enable_operation;
        return word;
    }

    /// Returns whether a fault is shown: not while it is being reset. [realtime]
    bool shows(bool fault, std::int64_t period_ns) noexcept {
        if (hidden_ns_ > 0) {
            hidden_ns_ -= period_ns;
            return false;
        }
        return fault;
    }

private:
    static constexpr std::int64_t hidden_for_ns = 100'000'000;
    std::int64_t hidden_ns_ = 0;
    bool last_enable_ = false;
};

}  // namespace hal::ethercat
