// SPDX-License-Identifier: MIT
// CANopen's data types and the number formats of EDS files.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace hal::canopen::eds {

enum class Kind : std::uint8_t {
    boolean,
    integer,
    natural,
    real,
    text,
    octets,
    unicode,
    time,
    domain,
    structure
};

struct DataType {
    std::uint16_t code;
    std::string_view name;  ///< as CiA 301 writes it
    Kind kind;
    unsigned bits;          ///< 0: any number of bytes
    unsigned bytes() const { return (bits + 7) / 8; }
};

/// Returns a standard or complex type of CiA 301; nullptr for the types of manufacturers and
/// profiles.
const DataType* data_type(std::uint16_t code);
const DataType* data_type(std::string_view name);
std::span<const DataType> data_types();

/// Deviations in the spelling of a number.
enum class Spelling : std::uint8_t {
    plain,
    octal,
    decimal_with_zero,
    unsigned_for_negative,
    number_as_real,
    real_as_bits,
    words
};

struct Number {
    bool negative = false;
    std::uint64_t magnitude = 0;
    bool node_id = false;  ///< `$NODEID` is added to it
    bool hex = false;
    Spelling spelling = Spelling::plain;
};

/// Parses a sum of C integer literals (0x… hexadecimal, 0… octal) and at most one `$NODEID`.
/// Returns nothing if the text is invalid.
std::optional<Number> parse_number(std::string_view text);
/// Parses a decimal fraction, or a number as above.
std::optional<double> parse_real(std::string_view text);

struct Encoded {
    std::vector<std::uint8_t> bytes;  ///< little endian, as in an SDO
    bool node_id = false;             ///< depends on the node ID
    Spelling spelling = Spelling::plain;
    /// reason if the text is invalid: "'300' does not fit into UNSIGNED8 (0..255)"
    std::string error;
    explicit operator bool() const { return error.empty(); }
};

/// Encodes the value `text` of an object of type `code` on node `node_id`. An empty text gives no
/// bytes and no error.
Encoded encode(std::string_view text, std::uint16_t code, unsigned node_id);

/// Encodes a value typed by a user: without octal numbers, and a decimal number out of range is an
/// error. In files such a number stands for the same bits with the other sign.
Encoded encode_strictly(std::string_view text, std::uint16_t code, unsigned node_id);

/// Decodes a value to the text that the writer uses: hexadecimal for unsigned numbers, decimal for
/// signed ones, strings unchanged.
std::string spell(std::span<const std::uint8_t> bytes, std::uint16_t code);

/// A value for the comparison with another of the same data type. Exact for each: not every machine
/// has a floating-point type with 64 bits of mantissa.
using Comparable = std::variant<std::int64_t, std::uint64_t, double>;

/// Returns the value as a number for the comparison with limits; nothing for strings.
std::optional<Comparable> comparable(std::string_view text, std::uint16_t code, unsigned node_id);

}  // namespace hal::canopen::eds
