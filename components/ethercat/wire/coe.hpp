// SPDX-License-Identifier: MIT
// CANopen over EtherCAT (ETG.1000.6, clause 5.6): SDO requests and responses, SDO information,
// emergencies. All offsets are from the start of the payload of the mailbox, which begins with the
// CoE header.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "cia301/abort.hpp"
#include "cia301/types.hpp"
#include "ethercat/wire/byte_order.hpp"
#include "ethercat/wire/mailbox.hpp"

namespace hal::ethercat::coe {

inline constexpr std::size_t header_bytes = 2;
enum class Service : std::uint8_t {
    emergency = 1,
    sdo_request = 2,
    sdo_response = 3,
    tx_pdo = 4,
    rx_pdo = 5,
    tx_pdo_remote = 6,
    rx_pdo_remote = 7,
    sdo_information = 8
};
/// Returns the service of a message; its CoE header must be complete. [realtime]
inline Service service_of(const std::uint8_t* payload) noexcept {
    return static_cast<Service>(get<std::uint16_t>(payload) >> 12);
}
/// Writes the CoE header. [realtime]
inline void write_header(std::uint8_t* to, Service service) noexcept {
    put(to, static_cast<std::uint16_t>(static_cast<unsigned>(service) << 12));
}

// SDO: CoE header, u8 command, u16 index, u8 sub-index, 4 bytes of data or size; data.
inline constexpr std::size_t sdo_bytes = 10;                 ///< payload of the short forms
/// offset of expedited data, of the size, of the abort code
inline constexpr std::size_t sdo_data = 6;
inline constexpr std::size_t segment_data = 3;               ///< offset of the data of a segment
/// payload of a segment: shorter data is padded, and its unused bytes are
inline constexpr std::size_t smallest_segment = 10;
    ///< counted
/// Returns the data bytes that the first message of a normal transfer holds. [any]
constexpr std::size_t normal_capacity(std::size_t mailbox) noexcept {
    return mailbox - mailbox_header_bytes - sdo_bytes;
}
/// Returns the data bytes that a segment holds. [any]
constexpr std::size_t segment_capacity(std::size_t mailbox) noexcept {
    return mailbox - mailbox_header_bytes - segment_data;
}

/// Bits of the SDO command.
namespace command {
inline constexpr std::uint8_t size_given = 0x01;
inline constexpr std::uint8_t expedited = 0x02;
inline constexpr std::uint8_t complete = 0x10;
inline constexpr std::uint8_t toggle = 0x10;

inline constexpr std::uint8_t last_segment = 0x01;
inline constexpr std::uint8_t specifier = 0xe0;
// requests
inline constexpr std::uint8_t download_segment = 0x00;
inline constexpr std::uint8_t download = 0x20;
inline constexpr std::uint8_t upload = 0x40;

inline constexpr std::uint8_t upload_segment = 0x60;
inline constexpr std::uint8_t abort = 0x80;
// responses
inline constexpr std::uint8_t upload_segment_response = 0x00;
inline constexpr std::uint8_t download_segment_response = 0x20;

inline constexpr std::uint8_t upload_response = 0x40;
inline constexpr std::uint8_t download_response = 0x60;
}  // namespace command

/// Fields of an SDO that is not a segment.
struct Sdo {
    std::uint8_t command = 0;
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    std::uint32_t value = 0;  ///< expedited data, size of the whole transfer, or abort code

    bool is(std::uint8_t specifier) const noexcept {
        return (command & command::specifier) == specifier;
    }
    bool expedited() const noexcept { return (command & command::expedited) != 0; }
    bool complete() const noexcept { return (command & command::complete) != 0; }
    /// Returns the bytes of expedited data: 1..4.
    std::size_t expedited_bytes() const noexcept {
        return (command & command::size_given) != 0 ? 4U - (command >> 2 & 3U) : 4U;
    }
};
/// Reads an SDO; nullopt if the payload is too short. [realtime]
inline std::optional<Sdo> read_sdo(std::span<const std::uint8_t> payload) noexcept {
    if (payload.size() < sdo_bytes) return std::nullopt;
    const std::uint8_t* at = payload.data();
    return Sdo{at[2], get<std::uint16_t>(at + 3), at[5], get<std::uint32_t>(at + sdo_data)};
}
/// Writes an SDO with its CoE header; returns sdo_bytes. [realtime]
inline std::size_t write_sdo(std::uint8_t* to, Service service, const Sdo& sdo) noexcept {
    write_header(to, service);
    to[2] = sdo.command;
    put(to + 3, sdo.index);
    to[5] = sdo.sub;
    put(to + sdo_data, sdo.value);
    return sdo_bytes;
}
/// Returns the command of an expedited transfer of 1..4 bytes: 2Fh for one byte of a download.
/// [any]
constexpr std::uint8_t expedited_command(std::uint8_t specifier, std::size_t bytes) noexcept {
    return static_cast<std::uint8_t>(specifier | (4 - bytes) << 2 | command::expedited |
                                     command::size_given);
}
/// Writes a segment with its CoE header: data of 0..capacity bytes, padded to 7; returns the length
/// of the payload. [realtime]
inline std::size_t write_segment(std::uint8_t* to, Service service, std::uint8_t specifier,
                                 bool toggle, bool last,
                                 std::span<const std::uint8_t> data) noexcept {
    write_header(to, service);
    const std::size_t unused = data.size() < 7 ? 7 - data.size() : 0;
    to[2] = static_cast<std::uint8_t>(specifier | (toggle ? command::toggle : 0) | unused << 1 |
                                      (last ? command::last_segment : 0));
    if (!data.empty()) {
        std::memcpy(to + segment_data, data.data(), data.size());
    }
    if (unused != 0) {
        std::memset(to + segment_data + data.size(), 0, unused);
    }
    return segment_data + data.size() + unused;
}
/// Returns the data of a segment; the number of unused bytes counts only in the shortest message.
/// Empty for a payload that is too short. [realtime]
inline std::span<const std::uint8_t> segment_of(std::span<const std::uint8_t> payload) noexcept {
    if (payload.size() <= segment_data) {
        return {};
    }
    const std::size_t unused = payload.size() == smallest_segment ? payload[2] >> 1 & 7U : 0;
    return payload.subspan(segment_data, payload.size() - segment_data - unused);
}

using cia301::Abort;
/// Returns the meaning of an abort code in a message; "unknown abort code" for others. [any]
inline const char* abort_text(std::uint32_t code) noexcept {
    return cia301::to_string(static_cast<Abort>(code));
}

// SDO information: CoE header, u8 opcode (bit 7: incomplete), u8 0, u16 fragments left; data.
inline constexpr std::size_t information_header_bytes = 6;
inline constexpr std::uint8_t information_incomplete = 0x80;
enum class Information : std::uint8_t {
    list_request = 1,
    list_response = 2,
    object_request = 3,
    object_response = 4,
    entry_request = 5,
    entry_response = 6,
    error = 7
};
/// Lists of objects.
enum class List : std::uint16_t {
    lengths = 0,
    all = 1,
    rx_mappable = 2,
    tx_mappable = 3,
    backup = 4,
    settings = 5
};
struct InformationHeader {
    Information opcode{};
    bool incomplete = false;
    std::uint16_t fragments_left = 0;
};
/// Reads the header of SDO information; nullopt if the payload is too short. [realtime]
inline std::optional<InformationHeader> read_information(
    std::span<const std::uint8_t> payload) noexcept {
    if (payload.size() < information_header_bytes) return std::nullopt;
    return InformationHeader{static_cast<Information>(payload[2] & 0x7f),
                             (payload[2] & information_incomplete) != 0,
                             get<std::uint16_t>(payload.data() + 4)};
}
/// Writes the CoE header and that of SDO information. [realtime]
inline void write_information(std::uint8_t* to, InformationHeader h) noexcept {
    write_header(to, Service::sdo_information);
    to[2] = static_cast<std::uint8_t>(static_cast<unsigned>(h.opcode) |
                                      (h.incomplete ? information_incomplete : 0U));
    to[3] = 0;
    put(to + 4, h.fragments_left);
}
/// Codes of objects (CiA 301).
enum class ObjectCode : std::uint8_t { variable = 7, array = 8, record = 9 };
/// Indices of basic data types, as messages and dictionaries carry them.
namespace type {
constexpr std::uint16_t index_of(cia301::Type type) noexcept {
    return static_cast<std::uint16_t>(type);
}
inline constexpr std::uint16_t boolean = index_of(cia301::Type::boolean);
inline constexpr std::uint16_t s8 = index_of(cia301::Type::integer8);
inline constexpr std::uint16_t s16 = index_of(cia301::Type::integer16);
inline constexpr std::uint16_t s32 = index_of(cia301::Type::integer32);
inline constexpr std::uint16_t u8 = index_of(cia301::Type::unsigned8);
inline constexpr std::uint16_t u16 = index_of(cia301::Type::unsigned16);
inline constexpr std::uint16_t u32 = index_of(cia301::Type::unsigned32);
inline constexpr std::uint16_t real32 = index_of(cia301::Type::real32);
inline constexpr std::uint16_t visible_string = index_of(cia301::Type::visible_string);
inline constexpr std::uint16_t octet_string = index_of(cia301::Type::octet_string);
inline constexpr std::uint16_t real64 = index_of(cia301::Type::real64);
inline constexpr std::uint16_t s64 = index_of(cia301::Type::integer64);
inline constexpr std::uint16_t u64 = index_of(cia301::Type::unsigned64);
inline constexpr std::uint16_t bit1 = index_of(cia301::Type::bit1);
inline constexpr std::uint16_t pdo_mapping = index_of(cia301::Type::pdo_mapping);
inline constexpr std::uint16_t identity = index_of(cia301::Type::identity);
inline constexpr std::uint16_t command_parameter = index_of(cia301::Type::command_parameter);
inline constexpr std::uint16_t pdo_parameter = index_of(cia301::Type::pdo_parameter);
}  // namespace type
/// Bits of the access rights of an entry.
namespace access {
inline constexpr std::uint16_t read_preop = 0x01;
inline constexpr std::uint16_t read_safeop = 0x02;
inline constexpr std::uint16_t read_op = 0x04;

inline constexpr std::uint16_t write_preop = 0x08;
inline constexpr std::uint16_t write_safeop = 0x10;
inline constexpr std::uint16_t write_op = 0x20;

inline constexpr std::uint16_t rx_mappable = 0x40;
inline constexpr std::uint16_t tx_mappable = 0x80;
inline constexpr std::uint16_t backup = 0x100;

inline constexpr std::uint16_t setting = 0x200;
inline constexpr std::uint16_t read = 0x07;
inline constexpr std::uint16_t write = 0x38;
inline constexpr std::uint16_t read_write = 0x3f;
}  // namespace access
// After the header of SDO information: list request u16 type; list response u16 type, then u16
// indices; object request u16 index; object response u16 index, u16 type, u8 largest sub-index, u8
// object code, name; entry request u16 index, u8 sub, u8 value info; entry response u16 index, u8
// sub, u8 value info, u16 type, u16 bits, u16 access, name; error u32 abort code.
/// offsets of names
inline constexpr std::size_t object_name = information_header_bytes + 6;

inline constexpr std::size_t entry_name = information_header_bytes + 10;

/// An emergency: CoE header, u16 code, u8 error register, 5 bytes.
inline constexpr std::size_t emergency_bytes = 10;
struct Emergency {
    std::uint16_t code = 0;
    std::uint8_t error_register = 0;
    std::uint8_t data[5] = {};
};
/// Reads an emergency; nullopt if the payload is too short. [realtime]
inline std::optional<Emergency> read_emergency(std::span<const std::uint8_t> payload) noexcept {
    if (payload.size() < emergency_bytes) return std::nullopt;
    Emergency e{get<std::uint16_t>(payload.data() + 2), payload[4], {}};
    std::memcpy(e.data, payload.data() + 5, sizeof e.data);
    return e;
}
/// Writes an emergency; returns its length. [realtime]
inline std::size_t write_emergency(std::uint8_t* to, const Emergency& e) noexcept {
    write_header(to, Service::emergency);
    put(to + 2, e.code);
    to[4] = e.error_register;
    std::memcpy(to + 5, e.data, sizeof e.data);
    return emergency_bytes;
}

/// An entry of a PDO mapping: index << 16 | sub << 8 | bits.
struct Mapping {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    std::uint8_t bits = 0;
    constexpr std::uint32_t raw() const noexcept {
        return static_cast<std::uint32_t>(index) << 16 | static_cast<std::uint32_t>(sub) << 8 |
               bits;
    }
    static constexpr Mapping of(std::uint32_t raw) noexcept {
        return {static_cast<std::uint16_t>(raw >> 16), static_cast<std::uint8_t>(raw >> 8),
                static_cast<std::uint8_t>(raw)};
    }
};
/// assignment + number
inline constexpr std::uint16_t rx_pdo = 0x1600;
inline constexpr std::uint16_t tx_pdo = 0x1a00;
inline constexpr std::uint16_t sync_manager_types = 0x1c00;

inline constexpr std::uint16_t assignment = 0x1c10;

}  // namespace hal::ethercat::coe
