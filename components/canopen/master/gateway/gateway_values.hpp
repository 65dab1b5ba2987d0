// SPDX-License-Identifier: MIT
// Data types and values as CiA 309-3 writes them: `u16 567`, `r32 1.5`, `vs "two words"`,
// `d aGFsY3lvbg==`.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canopen/protocol/numbers.hpp"

namespace hal::canopen::gateway {

struct Format {
    std::string_view word;
    Type type = Type::none;
    /// an addition: unsigned in hexadecimal (x8 … x64), or bytes (hex)
    bool hex = false;
};

std::span<const Format> formats();
/// Ignores case. Returns nullptr for an unknown name.
const Format* format(std::string_view word);
/// Returns the first row of that type; nullptr for a type without a row.
const Format* format(Type type);

/// The value in one word, quoted where it needs to be; two words for times. Bytes of another length
/// than the type's come as `hex`.
std::string text_of(std::span<const std::uint8_t> bytes, const Format& format);
/// Returns the number of words of its value.
constexpr std::size_t words_of(const Format& format) {
    return format.type == Type::time_of_day || format.type == Type::time_difference ? 2 : 1;
}
/// Reads the value from words_of() words, the last of which may be followed by more for `hex`;
/// false when they do not spell one.
bool bytes_of(std::span<const std::string> words, const Format& format,
              std::vector<std::uint8_t>& bytes);

/// As C spells it: decimal, 0x… hexadecimal, 0… octal, with a sign.
bool read_number(std::string_view text, bool& negative, std::uint64_t& magnitude);

std::string base64(std::span<const std::uint8_t> bytes);
/// Returns false for invalid base64; blanks and missing padding are accepted.
bool base64(std::string_view text, std::vector<std::uint8_t>& bytes);

}  // namespace hal::canopen::gateway
