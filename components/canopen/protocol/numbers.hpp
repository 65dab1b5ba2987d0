// SPDX-License-Identifier: MIT
// The constants of CiA 301: data types, access rights, SDO abort codes and values are those of
// `cia301/`; NMT states and commands, and identifiers, are of CANopen only.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <type_traits>

#include "cia301/abort.hpp"
#include "cia301/types.hpp"
#include "cia301/values.hpp"

namespace hal::canopen {

/// Nanoseconds on the caller's clock; only differences are used.
using Time = std::int64_t;
inline constexpr Time microsecond = 1000;
inline constexpr Time millisecond = 1000 * microsecond;

inline constexpr Time second = 1000 * millisecond;

using cia301::Abort;
using cia301::Access;
using cia301::bits_of;
using cia301::bytes_of;
using cia301::is_real;
using cia301::is_signed;
using cia301::load;
using cia301::readable;
using cia301::store;
using cia301::to_string;
using cia301::Type;
using cia301::writable;

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
/// Returns the name of the command, such as "enter pre-operational"; nullptr for an undefined
/// value. [any]
const char* to_string(NmtCommand) noexcept;

/// Bits 31, 30 and 29 of a COB-ID object (1005h, 1014h, 1400h:1, …); the meaning of bit 30 depends
/// on the object.
inline constexpr std::uint32_t cob_invalid = 0x80000000;
inline constexpr std::uint32_t cob_flag30 = 0x40000000;

inline constexpr std::uint32_t cob_extended = 0x20000000;
/// Returns the CAN identifier in a COB-ID object, 11 or 29 bits. [any]
constexpr std::uint32_t cob_id(std::uint32_t cob) noexcept {
    return cob & ((cob & cob_extended) != 0 ? 0x1fffffffU : 0x7ffU);
}
/// Returns true for the 11-bit identifiers of SDO channels (CiA 301, without the default ones of
/// node IDs that do not exist). [any]
constexpr bool is_sdo_id(std::uint32_t id) noexcept {
    return (id >= 0x581 && id <= 0x5ff) || (id >= 0x601 && id <= 0x67f);
}
/// Returns true for the 11-bit identifiers that CiA 301 and CiA 304 restrict to one service. [any]
constexpr bool restricted(std::uint32_t id) noexcept {
    struct Range {
        std::uint32_t first, last;
    };
    constexpr Range ranges[] = {{0, 0x07f},     {0x101, 0x180}, {0x581, 0x5ff},     {0x601, 0x67f},
                                {0x6e0, 0x6ff}, {0x701, 0x77f}, {0x780, 0xffffffff}};
    for (const Range& range : ranges) {
        if (id >= range.first && id <= range.last) return true;
    }
    return false;
}
/// Returns true if a COB-ID object has an 11-bit identifier that is restricted to one service.
/// [any]
constexpr bool has_restricted_id(std::uint32_t cob) noexcept {
    return (cob & cob_extended) == 0 && restricted(cob_id(cob));
}
/// Returns true if a COB-ID object has such an identifier, or the default one of SYNC. [any]
constexpr bool is_reserved(std::uint32_t cob) noexcept {
    return has_restricted_id(cob) || ((cob & cob_extended) == 0 && cob_id(cob) == 0x80);
}
/// Returns true if two COB-ID objects differ in their identifiers or the length of these. [any]
constexpr bool differs_in_id(std::uint32_t cob, std::uint32_t other) noexcept {
    return ((cob ^ other) & 0x3fffffff) != 0;
}

/// Returns the CRC-16 of SDO block transfer and SRDO signatures: polynomial 1021h, initial value 0,
/// no reflection. `crc` continues an earlier call. [any]
std::uint16_t crc16(std::span<const std::uint8_t> data, std::uint16_t crc = 0) noexcept;

}  // namespace hal::canopen
