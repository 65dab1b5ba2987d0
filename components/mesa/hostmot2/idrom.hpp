// SPDX-License-Identifier: MIT
// The identity of a HostMot2 firmware: cookie, name, and the IDROM, which has the addresses of the
// descriptors of modules and pins.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "mesa/lbp16/bytes.hpp"

namespace hal::mesa {

inline constexpr std::uint16_t cookie_address = 0x0100;
inline constexpr std::uint32_t hostmot2_cookie = 0x55aacafe;
inline constexpr std::uint16_t firmware_name_address = 0x0104;
inline constexpr std::string_view firmware_name = "HOSTMOT2";
/// The low 16 bits of this register are the address of the IDROM.
inline constexpr std::uint16_t idrom_offset_address = 0x010c;
inline constexpr std::uint16_t usual_idrom_address = 0x0400;

inline constexpr unsigned max_pins = 1000;
inline constexpr std::uint32_t min_clock_hz = 1'000'000;

/// The IDROM as it is in the registers.
struct Idrom {
    static constexpr std::size_t size = 0x40;

    std::uint32_t type = 2;  ///< 2, or 3 with a larger pin table
    std::uint32_t modules = 0x40;  ///< offset of the module descriptors from the IDROM
    std::uint32_t pins = 0x200;    ///< offset of the pin descriptors from the IDROM
    std::array<char, 8> board{};   ///< not terminated
    std::uint32_t fpga_size = 0;
    std::uint32_t fpga_pins = 0;
    std::uint32_t ports = 0;
    std::uint32_t width = 0;       ///< pins of all ports
    std::uint32_t port_width = 0;  ///< pins of one port
    std::uint32_t clock_low_hz = 100'000'000;
    std::uint32_t clock_high_hz = 200'000'000;
    std::array<std::uint32_t, 2> instance_strides{4, 0x40};
    std::array<std::uint32_t, 2> register_strides{0x100, 0x100};

    std::array<std::uint8_t, size> encode() const noexcept;
    /// Returns nothing if there are too few bytes; the values are not checked. [any]
    static std::optional<Idrom> decode(std::span<const std::uint8_t> bytes) noexcept;

    friend bool operator==(const Idrom&, const Idrom&) = default;
};

/// What makes an IDROM unusable.
enum class IdromFault : std::uint8_t {
    none,
    type,         ///< not 2 or 3
    width,        ///< the width of all ports is not ports x width of one
    no_pins,      ///< no port, or ports without pins
    many_pins,    ///< more than max_pins
    clock,        ///< a clock is slower than min_clock_hz
    descriptors,  ///< a table of descriptors is outside the registers
};
/// Returns the first fault of an IDROM at `address`. [any]
IdromFault fault_of(const Idrom& idrom, std::uint16_t address) noexcept;

}  // namespace hal::mesa
