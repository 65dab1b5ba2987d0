// SPDX-License-Identifier: MIT
// CANopen's data types, and numbers as EDS files spell them.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace hal::canopen::eds {

enum class Kind : std::uint8_t { boolean, integer, natural, real, text, octets, unicode, time, domain, structure };

struct DataType {
    std::uint16_t    code;
    std::string_view name;  ///< as CiA 301 writes it
    Kind             kind;
    unsigned         bits;          ///< 0: any number of bytes
    unsigned         bytes() const { return (bits + 7) / 8; }
};

/// The standard types and the complex ones of CiA 301; null for others (manufacturers' and profiles' own).
const DataType*           data_type(std::uint16_t code);
const DataType*           data_type(std::string_view name);
std::span<const DataType> data_types();

/// What was odd about a number's spelling.
enum class Spelling : std::uint8_t { plain, octal, decimal_with_zero, unsigned_for_negative, number_as_real, real_as_bits, words };

struct Number {
    bool          negative = false;
    std::uint64_t magnitude = 0;
    bool          node_id = false;  ///< `$NODEID` is added to it
    bool          hex = false;
    Spelling      spelling = Spelling::plain;
};

/// A sum of numbers as C spells them (0x… hexadecimal, 0… octal) and at most one `$NODEID`; none when it is something else.
std::optional<Number> parse_number(std::string_view text);
/// A decimal fraction, or a number as above.
std::optional<double> parse_real(std::string_view text);

struct Encoded {
    std::vector<std::uint8_t> bytes;  ///< little endian, as SDO carries it
    bool                      node_id = false;             ///< depends on the node-id
    Spelling                  spelling = Spelling::plain;
    std::string               error;                ///< why there are no bytes: "'300' does not fit into UNSIGNED8 (0..255)"
    explicit                  operator bool() const { return error.empty(); }
};

/// The value `text` of an object of type `code` on node `node_id`. An empty text is a value of no bytes and no error.
Encoded encode(std::string_view text, std::uint16_t code, unsigned node_id);

/// The same of what a person writes by hand: no octal, and a decimal number that does not fit is an error, not the same bits with the
/// other sign, as files have it.
Encoded encode_strictly(std::string_view text, std::uint16_t code, unsigned node_id);

/// The opposite, as the writer spells it: hexadecimal for naturals, decimal for integers; text as it is.
std::string spell(std::span<const std::uint8_t> bytes, std::uint16_t code);

/// The value as a number to compare with limits; none for texts.
std::optional<long double> comparable(std::string_view text, std::uint16_t code, unsigned node_id);

}  // namespace hal::canopen::eds
