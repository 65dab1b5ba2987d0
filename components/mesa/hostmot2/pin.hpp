// SPDX-License-Identifier: MIT
// Pins of a HostMot2 firmware: every pin is an I/O bit of a port, and may be a pin of a module.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "mesa/hostmot2/module.hpp"

namespace hal::mesa {

/// The descriptor of a pin, one 32-bit register.
struct PinDescriptor {
    static constexpr std::uint8_t all_units = 0x80;

    std::uint8_t number = 0;  ///< which pin of the module; see pin_number
    bool is_output = false;   ///< of the module
    Tag module = Tag::none;   ///< none: the pin belongs to no module
    std::uint8_t unit = 0;    ///< which instance; all_units: shared by all
    Tag primary = Tag::ioport;

    constexpr std::uint32_t encode() const noexcept {
        std::uint32_t word = number & 0x7fU;
        word |= is_output ? 0x80U : 0U;
        word |= std::uint32_t{static_cast<std::uint8_t>(module)} << 8;
        word |= std::uint32_t{unit} << 16;
        word |= std::uint32_t{static_cast<std::uint8_t>(primary)} << 24;
        return word;
    }
    static constexpr PinDescriptor decode(std::uint32_t word) noexcept {
        return {.number = static_cast<std::uint8_t>(word & 0x7fU),
                .is_output = (word & 0x80U) != 0,
                .module = static_cast<Tag>(word >> 8 & 0xffU),
                .unit = static_cast<std::uint8_t>(word >> 16 & 0xffU),
                .primary = static_cast<Tag>(word >> 24)};
    }
    friend constexpr bool operator==(const PinDescriptor&, const PinDescriptor&) = default;
};

/// Numbers of the pins of modules, without the bit of outputs.
namespace pin_number {
namespace stepgen {
inline constexpr std::uint8_t step = 1, direction = 2, first_table = 3, last_table = 8, index = 9,
                              probe = 10;
}
namespace encoder {  // muxed encoders as well
inline constexpr std::uint8_t a = 1, b = 2, index = 3, mask = 4, probe = 5, shared_index = 6;
}
namespace pwm {
inline constexpr std::uint8_t out = 1, direction = 2, not_enable = 3;
}
namespace three_phase_pwm {
/// Outputs, and the inverted ones 3 later; the fault is an input.
inline constexpr std::uint8_t a = 1, b = 2, c = 3, first_inverted = 4, enable = 7, fault = 8;
}  // namespace three_phase_pwm
namespace smart_serial {
/// Outputs: of channel c the pins first + c; inputs: receive + c.
inline constexpr std::uint8_t first_transmit = 1, first_enable = 11, first_not_enable = 21,
                              first_receive = 1;
inline constexpr unsigned channels = 8;
}  // namespace smart_serial
namespace inmux {
inline constexpr std::uint8_t first_address = 1, data = 1;  ///< five outputs, one input
}
namespace ssr {
inline constexpr std::uint8_t reference = 32;  ///< internal; outputs are 1..31
}
namespace dpll {
inline constexpr std::uint8_t sync_in = 1, reference_out = 2, first_timer = 3;
}
}  // namespace pin_number

/// Returns what the pin is in its module: "step", "phase-A", "tx0", "out-03"; "" if there is no
/// module or the number is unknown. [setup]
std::string role_of(const PinDescriptor& pin);
/// Returns module, unit and role: "stepgen.00.step"; "" for a pin without module. [setup]
std::string function_of(const PinDescriptor& pin);

}  // namespace hal::mesa
