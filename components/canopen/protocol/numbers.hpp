// SPDX-License-Identifier: MIT
// The numbers of CiA 301: data types, access rights, abort codes, states and commands, and how values lie on the wire.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

namespace hal::canopen {

static_assert(std::endian::native == std::endian::little, "values are kept as they lie on the wire");

/// Nanoseconds on the clock of whoever calls; only differences count.
using Time = std::int64_t;
inline constexpr Time microsecond = 1000, millisecond = 1000 * microsecond, second = 1000 * millisecond;

/// Data types by their index in the object dictionary.
enum class Type : std::uint16_t {
    none = 0,
    boolean = 0x01, integer8 = 0x02, integer16 = 0x03, integer32 = 0x04, unsigned8 = 0x05, unsigned16 = 0x06, unsigned32 = 0x07,
    real32 = 0x08, visible_string = 0x09, octet_string = 0x0a, unicode_string = 0x0b, time_of_day = 0x0c, time_difference = 0x0d,
    domain = 0x0f, integer24 = 0x10, real64 = 0x11, integer40 = 0x12, integer48 = 0x13, integer56 = 0x14, integer64 = 0x15,
    unsigned24 = 0x16, unsigned40 = 0x18, unsigned48 = 0x19, unsigned56 = 0x1a, unsigned64 = 0x1b,
};

/// Length in bits; 0 for types without a fixed one. [any]
constexpr unsigned bits_of(Type type) noexcept {
    switch (type) {
    case Type::boolean: return 1;
    case Type::integer8: case Type::unsigned8: return 8;
    case Type::integer16: case Type::unsigned16: return 16;
    case Type::integer24: case Type::unsigned24: return 24;
    case Type::integer32: case Type::unsigned32: case Type::real32: return 32;
    case Type::integer40: case Type::unsigned40: return 40;
    case Type::integer48: case Type::unsigned48: case Type::time_of_day: case Type::time_difference: return 48;
    case Type::integer56: case Type::unsigned56: return 56;
    case Type::integer64: case Type::unsigned64: case Type::real64: return 64;
    default: return 0;
    }
}
/// Length in bytes; 0 for types without a fixed one. [any]
constexpr unsigned bytes_of(Type type) noexcept { return (bits_of(type) + 7) / 8; }
constexpr bool is_signed(Type type) noexcept {
    switch (type) {
    case Type::integer8: case Type::integer16: case Type::integer24: case Type::integer32:
    case Type::integer40: case Type::integer48: case Type::integer56: case Type::integer64: return true;
    default: return false;
    }
}
constexpr bool is_real(Type type) noexcept { return type == Type::real32 || type == Type::real64; }
/// "UNSIGNED16", …, or "" for none that is known. [any]
const char* to_string(Type) noexcept;

enum class Access : std::uint8_t { read_write, read_only, write_only, constant };
constexpr bool readable(Access access) noexcept { return access != Access::write_only; }
constexpr bool writable(Access access) noexcept { return access == Access::read_write || access == Access::write_only; }

/// Why an SDO transfer, or an access to the dictionary, did not happen.
enum class Abort : std::uint32_t {
    none = 0,
    toggle = 0x05030000, timeout = 0x05040000, command = 0x05040001, block_size = 0x05040002, sequence = 0x05040003, crc = 0x05040004,
    memory = 0x05040005,
    access = 0x06010000, write_only = 0x06010001, read_only = 0x06010002, no_object = 0x06020000, not_mappable = 0x06040041,
    pdo_length = 0x06040042, incompatible = 0x06040043, internal_incompatible = 0x06040047, hardware = 0x06060000,
    length = 0x06070010, too_long = 0x06070012, too_short = 0x06070013, no_sub = 0x06090011, value = 0x06090030, too_high = 0x06090031,
    too_low = 0x06090032, range_reversed = 0x06090036, no_resource = 0x060a0023,
    general = 0x08000000, cannot_store = 0x08000020, local_control = 0x08000021, device_state = 0x08000022, no_dictionary = 0x08000023,
    no_data = 0x08000024,
};
/// The abort in words; "unknown abort code" for one that is not in the table. [any]
const char* to_string(Abort) noexcept;

enum class NmtState : std::uint8_t { initialising = 0x00, stopped = 0x04, operational = 0x05, pre_operational = 0x7f };
const char* to_string(NmtState) noexcept;
enum class NmtCommand : std::uint8_t {
    start = 0x01, stop = 0x02, enter_pre_operational = 0x80, reset_node = 0x81, reset_communication = 0x82,
};

/// Bits of a COB-ID object (1005h, 1014h, 1400h:1, …).
inline constexpr std::uint32_t cob_invalid = 0x80000000, cob_flag30 = 0x40000000, cob_extended = 0x20000000;
/// The identifier inside a COB-ID object. [any]
constexpr std::uint32_t cob_id(std::uint32_t cob) noexcept { return cob & ((cob & cob_extended) != 0 ? 0x1fffffffU : 0x7ffU); }
/// 11-bit identifiers that belong to one service for ever and cannot be given to another. [any]
constexpr bool restricted(std::uint32_t id) noexcept {
    return id <= 0x07f || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5ff) || (id >= 0x601 && id <= 0x67f) ||
           (id >= 0x6e0 && id <= 0x6ff) || (id >= 0x701 && id <= 0x77f) || id >= 0x780;
}

/// The value at `from`, which need not be aligned. [any]
template <class T>
    requires std::is_trivially_copyable_v<T>
T load(const void* from) noexcept {
    T value;
    std::memcpy(&value, from, sizeof value);
    return value;
}
template <class T>
    requires std::is_trivially_copyable_v<T>
void store(void* to, T value) noexcept { std::memcpy(to, &value, sizeof value); }

/// CRC-16 of the block transfer: polynomial 1021h, start 0. [any]
std::uint16_t crc16(std::span<const std::uint8_t> data, std::uint16_t crc = 0) noexcept;

/// The size of the next block, as its receiver asks for it: half after a segment was lost, else growing again up to `most`. After a loss it
/// differs from the size before and from `good`, so that an acknowledgement that comes twice is not taken for that of the next block. [any]
constexpr std::uint8_t next_block_size(std::uint8_t size, bool lost, std::uint8_t good, std::uint8_t most) noexcept {
    const unsigned limit = most < 1 ? 1 : most > 127 ? 127 : most;
    unsigned next = size * 2U > limit ? limit : size * 2U;
    if (lost && limit > 2) {
        next = size > 1 ? size / 2U : 2;
        while (next == good || next == size) ++next;
    }
    return static_cast<std::uint8_t>(next);
}

}  // namespace hal::canopen
