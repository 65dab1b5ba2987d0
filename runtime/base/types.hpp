// SPDX-License-Identifier: MIT
// The one table of HAL types. Everything that depends on a type goes through visit() or through a
// row of it.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "hal/abi.h"
#include "text/numbers.hpp"

namespace hal {

struct TypeRow {
    hal_type type;
    const char* name;     ///< as netlists and `show` write it
    const char* newer;    ///< the second dialect's name (LinuxCNC 2.10), "" if the same
    char letter;          ///< in sampler/streamer cfg= strings
    bool number;          ///< can be written as a literal
};

inline constexpr std::array<TypeRow, 7> types{{
    {HAL_TYPE_BIT, "bit", "bool", 'b', true},
    {HAL_TYPE_FLOAT, "float", "real", 'f', true},
    {HAL_TYPE_S32, "s32", "si32", 's', true},
    {HAL_TYPE_U32, "u32", "ui32", 'u', true},
    {HAL_TYPE_S64, "s64", "sint", 'l', true},
    {HAL_TYPE_U64, "u64", "uint", 'k', true},
    {HAL_TYPE_PORT, "port", "", 'p', false},
}};

inline constexpr const TypeRow& row(hal_type type) { return types[static_cast<std::size_t>(type)]; }
inline constexpr const char* name(hal_type type) { return row(type).name; }
/// Returns the type of either dialect's name, in any case.
std::optional<hal_type> type_named(std::string_view name);

/// Calls `action` with a reference to the member of `value` that `type` selects (a hal_port* for
/// port).
template <class Action>
decltype(auto) visit(hal_type type, const hal_value& value, Action&& action) {
    switch (type) {
    case HAL_TYPE_BIT: return action(value.bit);
    case HAL_TYPE_FLOAT: return action(value.real);
    case HAL_TYPE_S32: return action(value.s32);
    case HAL_TYPE_U32: return action(value.u32);
    case HAL_TYPE_S64: return action(value.s64);
    case HAL_TYPE_U64: return action(value.u64);
    case HAL_TYPE_PORT: break;
    }
    return action(value.u64);
}

inline const char* name(hal_dir dir) {
    static constexpr const char* names[] = {"IN", "OUT", "I/O", "RW"};
    return names[static_cast<std::size_t>(dir)];
}

struct Parsed {
    hal_value value{};
    std::string problem;  ///< empty: none
    std::string warning;  ///< of parse_wrapping(): the number is out of range
};
/// What an integer is that begins with 0: octal in a netlist, as in C; decimal in records.
enum class LeadingZero { octal, decimal };
/// Parses a value of `type`. On failure `problem` is the reason: "'abc' is not a number",
/// "3000000000 is out of range for s32 (-2147483648 to 2147483647)".
Parsed parse_value(hal_type type, std::string_view text, LeadingZero = LeadingZero::octal);
/// As setp and sets of LinuxCNC 2.9 do: an integer that is out of range keeps its low bits, -1 is
/// 4294967295 as u32. `warning` reports it unless the text is a pattern of bits, as 0xFFFFFFFF is
/// for s32.
Parsed parse_wrapping(hal_type type, std::string_view text);

/// Formats a value as `getp` prints it: decimal, floats `%.7g`, bits TRUE/FALSE.
std::string format_value(hal_type type, const hal_value& value);
/// Formats a value so that reading it back gives the same value: floats with all digits (`save`).
std::string format_exact(hal_type type, const hal_value& value);

}  // namespace hal
