// SPDX-License-Identifier: MIT
// What is at which address of the memory spaces of a card, apart from HostMot2's registers.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "mesa/lbp16/packet.hpp"

namespace hal::mesa {

/// Ethernet EEPROM, units of 16 bits.
namespace eeprom {
inline constexpr std::uint16_t mac = 0x02;  ///< three units, the low one first: the MAC reversed
inline constexpr std::uint16_t name = 0x10;  ///< 16 characters
inline constexpr std::uint16_t ip = 0x20;    ///< two units, the low one first
inline constexpr std::uint16_t led_debug = 0x28;
}  // namespace eeprom

/// Timers, units of 16 bits. From LBP16 version 3.
namespace timers {
inline constexpr std::uint16_t microseconds = 0x00;
inline constexpr std::uint16_t wait_us = 0x02;
inline constexpr std::uint16_t hostmot2_timeout = 0x04;
inline constexpr std::uint16_t wait_reference = 0x06;
/// Four units that keep what is written: hosts number their packets in them.
inline constexpr std::uint16_t scratch = 0x10;
inline constexpr std::uint16_t read_count = 0x10;   ///< two units
inline constexpr std::uint16_t write_count = 0x14;  ///< two units
}  // namespace timers

/// Communication status, units of 16 bits.
namespace status {
inline constexpr std::uint16_t error = 0x00;
inline constexpr std::uint16_t parse_errors = 0x02;
inline constexpr std::uint16_t memory_errors = 0x04;
inline constexpr std::uint16_t write_errors = 0x06;
inline constexpr std::uint16_t received_packets = 0x08;
inline constexpr std::uint16_t received_udp = 0x0a;
inline constexpr std::uint16_t received_bad = 0x0c;
inline constexpr std::uint16_t sent_packets = 0x0e;
inline constexpr std::uint16_t sent_udp = 0x10;
inline constexpr std::uint16_t sent_bad = 0x12;
inline constexpr std::uint16_t led_mode = 0x14;
inline constexpr std::uint16_t scratch = 0x18;
inline constexpr std::uint16_t write_enable = 0x1a;  ///< of EEPROM and flash
}  // namespace status

/// The card, units of 16 bits.
namespace card {
inline constexpr std::uint16_t name = 0x00;  ///< 16 characters, as "7I76E-16"
inline constexpr std::uint16_t lbp_version = 0x10;
inline constexpr std::uint16_t firmware_version = 0x12;
inline constexpr std::uint16_t jumpers = 0x14;
}  // namespace card

/// The information area of a memory space.
struct Information {
    static constexpr std::size_t size = 16;
    enum class Kind : std::uint8_t { registers = 1, memory = 2, eeprom = 0xe, flash = 0xf };

    Space space = Space::hostmot2;
    bool is_writable = false;
    Kind kind = Kind::registers;
    std::uint8_t units = 0;  ///< bit n: units of 2^n bytes are allowed
    std::uint16_t range = 0;
    std::uint16_t pointer = 0;
    std::array<char, 8> name{};  ///< padded with NUL

    /// Returns the bytes, which begin with the cookie 5A00h + space. [any]
    std::array<std::uint8_t, size> encode() const noexcept;
    /// Returns nothing if there are too few bytes, or no cookie. [any]
    static std::optional<Information> decode(std::span<const std::uint8_t> bytes) noexcept;
    std::string_view name_text() const noexcept;

    friend bool operator==(const Information&, const Information&) = default;
};

/// Returns the text of a field of characters, without what follows its first NUL. [any]
std::string_view text_of(std::span<const char> field) noexcept;

/// Returns a MAC address from the bytes at eeprom::mac, or the bytes from the address. [any]
std::array<std::uint8_t, 6> reversed_mac(std::span<const std::uint8_t, 6> bytes) noexcept;

}  // namespace hal::mesa
