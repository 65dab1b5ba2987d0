// SPDX-License-Identifier: MIT
#include "bus/config/value_types.hpp"

#include "text/characters.hpp"

namespace hal::bus {

namespace {

using enum ValueType;

constexpr TypeName types[] = {
    {bit, "bit", "bool", "BOOL", 1},     {u8, "u8", nullptr, "USINT", 8},
    {u16, "u16", nullptr, "UINT", 16},   {u32, "u32", nullptr, "UDINT", 32},
    {u64, "u64", nullptr, "ULINT", 64},  {s8, "s8", "i8", "SINT", 8},
    {s16, "s16", "i16", "INT", 16},      {s32, "s32", "i32", "DINT", 32},
    {s64, "s64", "i64", "LINT", 64},     {f32, "f32", "real32", "REAL", 32},
    {f64, "f64", "real64", "LREAL", 64},
};

/// Further names in device descriptions.
struct Alias {
    const char* esi;
    ValueType type;
};
constexpr Alias aliases[] = {{"BIT", bit},  {"BIT1", bit},     {"BYTE", u8},   {"BITARR8", u8},
                             {"WORD", u16}, {"BITARR16", u16}, {"DWORD", u32}, {"BITARR32", u32}};

constexpr TypeName unknown{bit, nullptr, nullptr, nullptr, 0};

}  // namespace

TypeName parse_value_type(std::string_view word) {
    for (const TypeName& row : types) {
        if (same_word(word, row.name)) return row;
        if (row.old_name != nullptr && same_word(word, row.old_name)) {
            TypeName found = row;
            found.is_old = true;
            return found;
        }
    }
    return unknown;
}

TypeName parse_esi_type(std::string_view word) {
    for (const TypeName& row : types) {
        if (same_word(word, row.esi)) return row;
    }
    for (const Alias& alias : aliases) {
        if (word == alias.esi) return name_of(alias.type);
    }
    return unknown;
}

const TypeName& name_of(ValueType type) { return types[static_cast<std::size_t>(type)]; }

}  // namespace hal::bus
