// SPDX-License-Identifier: MIT
// The error register 1001h (CiA 301, clause 7.5.2.2).
#pragma once

#include <cstdint>

namespace hal::cia301 {

/// Bits of the error register.
enum ErrorRegister : std::uint8_t {
    error_generic = 0x01,
    error_current = 0x02,
    error_voltage = 0x04,
    error_temperature = 0x08,
    error_communication = 0x10,
    error_profile = 0x20,
    error_manufacturer = 0x80,
};

/// Returns the bit of the class of an error code of a drive; the generic bit is set with any other.
/// [any]
constexpr ErrorRegister register_bit_of(std::uint16_t code) noexcept {
    switch (code >> 12) {
    case 2: return error_current;
    case 3: return error_voltage;
    case 4: return error_temperature;
    default: return code >> 8 == 0x81 ? error_communication : error_profile;
    }
}

}  // namespace hal::cia301
