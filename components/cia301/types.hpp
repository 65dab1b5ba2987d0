// SPDX-License-Identifier: MIT
// The data types of an object dictionary by their index in it (CiA 301, clause 7.4.7; ETG.1020 adds
// those from 001Eh on), and the access rights of objects.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace hal::cia301 {

enum class Type : std::uint16_t {
    none = 0,
    boolean = 0x01,
    integer8 = 0x02,
    integer16 = 0x03,
    integer32 = 0x04,
    unsigned8 = 0x05,
    unsigned16 = 0x06,
    unsigned32 = 0x07,
    real32 = 0x08,
    visible_string = 0x09,
    octet_string = 0x0a,
    unicode_string = 0x0b,
    time_of_day = 0x0c,
    time_difference = 0x0d,
    domain = 0x0f,
    integer24 = 0x10,
    real64 = 0x11,
    integer40 = 0x12,
    integer48 = 0x13,
    integer56 = 0x14,
    integer64 = 0x15,
    unsigned24 = 0x16,
    unsigned40 = 0x18,
    unsigned48 = 0x19,
    unsigned56 = 0x1a,
    unsigned64 = 0x1b,
    // EtherCAT
    byte = 0x1e,
    word = 0x1f,
    dword = 0x20,
    pdo_mapping = 0x21,
    identity = 0x23,
    command_parameter = 0x25,
    pdo_parameter = 0x27,
    bit1 = 0x30,
    bit2,
    bit3,
    bit4,
    bit5,
    bit6,
    bit7,
    bit8,
};

/// Properties of a data type.
struct TypeRow {
    const char* name = "";  ///< in CiA 301; "" for those of EtherCAT
    std::uint8_t bits = 0;  ///< 0: of variable length
    bool is_signed = false;
    const char* iec_name = "";  ///< in IEC 61131-3, which EtherCAT uses; "" without one
};
namespace types {
struct Named {
    Type type;
    TypeRow row;
};
inline constexpr Named list[] = {
    {Type::boolean, {"BOOLEAN", 1, false, "BOOL"}},
    {Type::integer8, {"INTEGER8", 8, true, "SINT"}},
    {Type::integer16, {"INTEGER16", 16, true, "INT"}},
    {Type::integer32, {"INTEGER32", 32, true, "DINT"}},
    {Type::unsigned8, {"UNSIGNED8", 8, false, "USINT"}},
    {Type::unsigned16, {"UNSIGNED16", 16, false, "UINT"}},
    {Type::unsigned32, {"UNSIGNED32", 32, false, "UDINT"}},
    {Type::real32, {"REAL32", 32, false, "REAL"}},
    {Type::visible_string, {"VISIBLE_STRING", 0, false, "STRING"}},
    {Type::octet_string, {"OCTET_STRING", 0, false, "OCTET_STRING"}},
    {Type::unicode_string, {"UNICODE_STRING"}},
    {Type::time_of_day, {"TIME_OF_DAY", 48}},
    {Type::time_difference, {"TIME_DIFFERENCE", 48}},
    {Type::domain, {"DOMAIN"}},
    {Type::integer24, {"INTEGER24", 24, true, "INT24"}},
    {Type::real64, {"REAL64", 64, false, "LREAL"}},
    {Type::integer40, {"INTEGER40", 40, true, "INT40"}},
    {Type::integer48, {"INTEGER48", 48, true, "INT48"}},
    {Type::integer56, {"INTEGER56", 56, true, "INT56"}},
    {Type::integer64, {"INTEGER64", 64, true, "LINT"}},
    {Type::unsigned24, {"UNSIGNED24", 24, false, "UINT24"}},
    {Type::unsigned40, {"UNSIGNED40", 40, false, "UINT40"}},
    {Type::unsigned48, {"UNSIGNED48", 48, false, "UINT48"}},
    {Type::unsigned56, {"UNSIGNED56", 56, false, "UINT56"}},
    {Type::unsigned64, {"UNSIGNED64", 64, false, "ULINT"}},
    {Type::byte, {"", 8, false, "BYTE"}},
    {Type::word, {"", 16, false, "WORD"}},
    {Type::dword, {"", 32, false, "DWORD"}},
    {Type::pdo_mapping, {"", 0, false, "PDO_MAPPING"}},
    {Type::identity, {"", 0, false, "IDENTITY"}},
    {Type::pdo_parameter, {"", 0, false, "PDO_PARAMETER"}},
    {Type::bit1, {"", 1, false, "BIT1"}},
    {Type::bit2, {"", 2, false, "BIT2"}},
    {Type::bit3, {"", 3, false, "BIT3"}},
    {Type::bit4, {"", 4, false, "BIT4"}},
    {Type::bit5, {"", 5, false, "BIT5"}},
    {Type::bit6, {"", 6, false, "BIT6"}},
    {Type::bit7, {"", 7, false, "BIT7"}},
    {Type::bit8, {"", 8, false, "BIT8"}},
};
/// By the index of the type in the object dictionary.
inline constexpr auto rows = [] {
    std::array<TypeRow, static_cast<std::size_t>(Type::bit8) + 1> result{};
    for (const Named& named : list) {
        result[static_cast<std::size_t>(named.type)] = named.row;
    }
    return result;
}();
}  // namespace types
/// Returns the properties of a type; empty for an unknown one. [any]
constexpr const TypeRow& row_of(Type type) noexcept {
    const auto number = static_cast<std::size_t>(type);
    return types::rows[number < types::rows.size() ? number : 0];
}
/// Returns the length in bits; 0 for types of variable length. [any]
constexpr unsigned bits_of(Type type) noexcept { return row_of(type).bits; }
/// Returns the length in bytes; 0 for types of variable length. [any]
constexpr unsigned bytes_of(Type type) noexcept { return (bits_of(type) + 7) / 8; }
/// Returns true for INTEGER8 to INTEGER64. [any]
constexpr bool is_signed(Type type) noexcept { return row_of(type).is_signed; }
/// Returns true for REAL32 and REAL64. [any]
constexpr bool is_real(Type type) noexcept { return type == Type::real32 || type == Type::real64; }
/// Returns the name in CiA 301, such as "UNSIGNED16"; "" for an unknown type. [any]
constexpr const char* to_string(Type type) noexcept { return row_of(type).name; }
/// Returns the name in IEC 61131-3, such as "UINT"; "" for an unknown type. [any]
constexpr const char* iec_name(Type type) noexcept { return row_of(type).iec_name; }

/// Returns the type of the object that holds a C++ integer. [any]
template <class T>
    requires std::is_integral_v<T>
constexpr Type type_for() noexcept {
    constexpr bool has_sign = std::is_signed_v<T>;
    if constexpr (sizeof(T) == 1) return has_sign ? Type::integer8 : Type::unsigned8;
    if constexpr (sizeof(T) == 2) return has_sign ? Type::integer16 : Type::unsigned16;
    if constexpr (sizeof(T) == 4) return has_sign ? Type::integer32 : Type::unsigned32;
    return has_sign ? Type::integer64 : Type::unsigned64;
}

/// Access rights of an object: what an SDO client may do with it.
enum class Access : std::uint8_t { read_write, read_only, write_only, constant };
/// Returns true if an SDO may read the object. [any]
constexpr bool readable(Access access) noexcept { return access != Access::write_only; }
/// Returns true if an SDO may write the object. [any]
constexpr bool writable(Access access) noexcept {
    return access == Access::read_write || access == Access::write_only;
}

}  // namespace hal::cia301
