// SPDX-License-Identifier: MIT
// Objects of a CiA 301 dictionary by index and sub-index, as all configuration files write them.
// Everything here is [setup].
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace hal::bus {

/// How a sub-index is written.
enum class SubForm : std::uint8_t {
    plain,       ///< none, one digit, or hexadecimal with 0x: never had another meaning
    two_digits,  ///< "10": decimal; earlier versions read it as hexadecimal in EtherCAT files
    bare_hex,    ///< "1F": hexadecimal without 0x, a form of earlier versions
};

/// An object, or one value of it.
struct ObjectAddress {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    bool has_sub = false;
    SubForm form = SubForm::plain;
};

/// Parses INDEX or INDEX:SUB. The index is hexadecimal: four digits, or one to four behind 0x. The
/// sub-index is decimal, or hexadecimal with 0x. Accepts a sub-index of hexadecimal digits without
/// 0x, a form of earlier versions, and returns it as SubForm::bare_hex.
std::optional<ObjectAddress> parse_object_address(std::string_view text);

/// Formats an index: "0x6099".
std::string index_text(std::uint16_t index);
/// Formats an address: "0x6099:1".
std::string object_text(std::uint16_t index, unsigned sub);
/// Formats a number in hexadecimal: "0x1F".
std::string hex_text(unsigned value, int min_digits = 1);

}  // namespace hal::bus
