// SPDX-License-Identifier: MIT
// Types of values, as all configuration files name them. Everything here is [setup].
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace hal::bus {

enum class ValueType : std::uint8_t { bit, u8, u16, u32, u64, s8, s16, s32, s64, f32, f64 };

/// A type and its names.
struct TypeName {
    ValueType type;
    const char* name;      ///< in configuration files
    const char* old_name;  ///< in those of earlier versions; nullptr: the same
    const char* esi;       ///< in ETG.2000 and IEC 61131-3
    std::uint8_t bits;
    bool is_old = false;  ///< found by its old name
};

/// Finds a type by its name or by the one of earlier versions, in any case of letters. Returns a
/// type with the name nullptr for an unknown word.
TypeName parse_value_type(std::string_view word);
/// Finds a type by its name in ETG.2000; also `BIT`, `BYTE`, `WORD`, `DWORD`. The name is nullptr
/// for an unknown word.
TypeName parse_esi_type(std::string_view word);
/// Returns the row of a type.
const TypeName& name_of(ValueType type);
inline const char* to_string(ValueType type) { return name_of(type).name; }

/// Lists the types for help texts.
inline constexpr const char* value_type_names =
    "bit, u8, u16, u32, u64, s8, s16, s32, s64, f32 or f64";

constexpr bool is_signed(ValueType type) { return type >= ValueType::s8 && type <= ValueType::s64; }
constexpr bool is_real(ValueType type) { return type >= ValueType::f32; }

}  // namespace hal::bus
