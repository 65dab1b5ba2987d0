// SPDX-License-Identifier: MIT
// The constants of CiA 301: data types, access rights, SDO abort codes, NMT states and commands,
// and the byte order of values.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

namespace hal::canopen {

static_assert(std::endian::native == std::endian::little,
              "values are stored in the byte order of CAN frames, little endian");

/// Nanoseconds on the caller's clock; only differences are used.
using Time = std::int64_t;
inline constexpr Time microsecond = 1000;
inline constexpr Time millisecond = 1000 * microsecond;

inline constexpr Time second = 1000 * millisecond;

/// Data types by their index in the object dictionary, 0001h..001Bh (CiA 301).
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
};

/// Properties of a data type.
struct TypeRow {
    const char* name = "";
    std::uint8_t bits = 0;  ///< 0: of variable length
    bool is_signed = false;
};
/// By the index of the type in the object dictionary.
inline constexpr std::array<TypeRow, 0x1c> type_rows{{
    {},
    {"BOOLEAN", 1},
    {"INTEGER8", 8, true},
    {"INTEGER16", 16, true},
    {"INTEGER32", 32, true},
    {"UNSIGNED8", 8},
    {"UNSIGNED16", 16},
    {"UNSIGNED32", 32},
    {"REAL32", 32},
    {"VISIBLE_STRING"},
    {"OCTET_STRING"},
    {"UNICODE_STRING"},
    {"TIME_OF_DAY", 48},
    {"TIME_DIFFERENCE", 48},
    {},
    {"DOMAIN"},
    {"INTEGER24", 24, true},
    {"REAL64", 64},
    {"INTEGER40", 40, true},
    {"INTEGER48", 48, true},
    {"INTEGER56", 56, true},
    {"INTEGER64", 64, true},
    {"UNSIGNED24", 24},
    {},
    {"UNSIGNED40", 40},
    {"UNSIGNED48", 48},
    {"UNSIGNED56", 56},
    {"UNSIGNED64", 64},
}};
/// Returns the properties of a type; empty for an unknown one. [any]
constexpr const TypeRow& row_of(Type type) noexcept {
    const auto number = static_cast<std::size_t>(type);
    return type_rows[number < type_rows.size() ? number : 0];
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

/// Access rights of an object: what an SDO client may do with it.
enum class Access : std::uint8_t { read_write, read_only, write_only, constant };
/// Returns true if an SDO may read the object. [any]
constexpr bool readable(Access access) noexcept { return access != Access::write_only; }
/// Returns true if an SDO may write the object. [any]
constexpr bool writable(Access access) noexcept {
    return access == Access::read_write || access == Access::write_only;
}

/// SDO abort codes (CiA 301): why an SDO transfer or an access to the dictionary failed.
enum class Abort : std::uint32_t {
    none = 0,
    toggle = 0x05030000,
    timeout = 0x05040000,
    command = 0x05040001,
    block_size = 0x05040002,
    sequence = 0x05040003,
    crc = 0x05040004,
    memory = 0x05040005,
    access = 0x06010000,
    write_only = 0x06010001,
    read_only = 0x06010002,
    no_object = 0x06020000,
    not_mappable = 0x06040041,
    pdo_length = 0x06040042,
    incompatible = 0x06040043,
    internal_incompatible = 0x06040047,
    hardware = 0x06060000,
    length = 0x06070010,
    too_long = 0x06070012,
    too_short = 0x06070013,
    no_sub = 0x06090011,
    value = 0x06090030,
    too_high = 0x06090031,
    too_low = 0x06090032,
    range_reversed = 0x06090036,
    no_resource = 0x060a0023,
    general = 0x08000000,
    cannot_store = 0x08000020,
    local_control = 0x08000021,
    device_state = 0x08000022,
    no_dictionary = 0x08000023,
    no_data = 0x08000024,
};
/// Returns the description of the abort code; "unknown abort code" if CiA 301 does not define it.
/// [any]
const char* to_string(Abort) noexcept;

/// NMT states as a heartbeat carries them (CiA 301).
enum class NmtState : std::uint8_t {
    initialising = 0x00,
    stopped = 0x04,
    operational = 0x05,
    pre_operational = 0x7f
};
/// Returns the name of the state, such as "pre-operational"; "unknown" for an undefined value.
/// [any]
const char* to_string(NmtState) noexcept;
/// NMT command specifiers (CiA 301).
enum class NmtCommand : std::uint8_t {
    start = 0x01,
    stop = 0x02,
    enter_pre_operational = 0x80,
    reset_node = 0x81,
    reset_communication = 0x82,
};

/// Bits 31, 30 and 29 of a COB-ID object (1005h, 1014h, 1400h:1, …); the meaning of bit 30 depends
/// on the object.
inline constexpr std::uint32_t cob_invalid = 0x80000000;
inline constexpr std::uint32_t cob_flag30 = 0x40000000;

inline constexpr std::uint32_t cob_extended = 0x20000000;
/// Returns the CAN identifier in a COB-ID object, 11 or 29 bits. [any]
constexpr std::uint32_t cob_id(std::uint32_t cob) noexcept {
    return cob & ((cob & cob_extended) != 0 ? 0x1fffffffU : 0x7ffU);
}
/// Returns true for the 11-bit identifiers that CiA 301 and CiA 304 restrict to one service. [any]
constexpr bool restricted(std::uint32_t id) noexcept {
    return id <= 0x07f || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5ff) ||
           (id >= 0x601 && id <= 0x67f) || (id >= 0x6e0 && id <= 0x6ff) ||
           (id >= 0x701 && id <= 0x77f) || id >= 0x780;
}

/// Returns the little-endian value at `from`, which need not be aligned. [any]
template <class T>
    requires std::is_trivially_copyable_v<T>
T load(const void* from) noexcept {
    T value;
    std::memcpy(&value, from, sizeof value);
    return value;
}
/// Stores `value` little endian at `to`, which need not be aligned. [any]
template <class T>
    requires std::is_trivially_copyable_v<T>
void store(void* to, T value) noexcept {
    std::memcpy(to, &value, sizeof value);
}

/// Returns the CRC-16 of SDO block transfer and SRDO signatures: polynomial 1021h, initial value 0,
/// no reflection. `crc` continues an earlier call. [any]
std::uint16_t crc16(std::span<const std::uint8_t> data, std::uint16_t crc = 0) noexcept;

}  // namespace hal::canopen
