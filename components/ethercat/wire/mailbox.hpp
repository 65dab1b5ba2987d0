// SPDX-License-Identifier: MIT
// The mailbox header (ETG.1000.4, clause 5.6) that every mailbox protocol follows, and mailbox
// errors.
//
//     if (auto message = read_mailbox(bytes)) take(message->type, message->payload);
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "ethercat/wire/byte_order.hpp"

namespace hal::ethercat {

inline constexpr std::size_t mailbox_header_bytes = 6;
inline constexpr std::size_t smallest_mailbox = 16;   ///< bytes: a header and an SDO of 10 bytes
inline constexpr std::size_t max_mailbox = 1486;  ///< bytes of one datagram

enum class MailboxType : std::uint8_t {
    error = 0,
    aoe = 1,
    eoe = 2,
    coe = 3,
    foe = 4,
    soe = 5,
    voe = 15
};
/// A mailbox protocol: its name, which is that of its element in an ESI, and its bit in the SII
/// (word 1Ch).
struct MailboxProtocol {
    MailboxType type{};
    const char* name = "";
    std::uint16_t bit = 0;
};
/// All protocols. What lists, describes or prints them follows from these rows; the README of
/// `master/` names the other places of a new protocol.
inline constexpr MailboxProtocol mailbox_protocols[] = {
    {MailboxType::aoe, "AoE", 0x01}, {MailboxType::eoe, "EoE", 0x02},
    {MailboxType::coe, "CoE", 0x04}, {MailboxType::foe, "FoE", 0x08},
    {MailboxType::soe, "SoE", 0x10}, {MailboxType::voe, "VoE", 0x20},
};
/// Returns the row of a protocol; an empty one for mailbox errors and undefined numbers. [any]
constexpr MailboxProtocol protocol_of(MailboxType type) noexcept {
    for (const MailboxProtocol& row : mailbox_protocols) {
        if (row.type == type) return row;
    }
    return {};
}
/// Returns the bit of a protocol in the SII. [any]
constexpr std::uint16_t bit_of(MailboxType type) noexcept { return protocol_of(type).bit; }
/// Returns "CoE" and the like, "unknown protocol" for an undefined number. [any]
constexpr const char* to_string(MailboxType type) noexcept {
    if (type == MailboxType::error) return "mailbox error";
    const MailboxProtocol row = protocol_of(type);
    return row.bit != 0 ? row.name : "unknown protocol";
}

/// A message of a mailbox. The payload points into the mailbox.
struct MailboxMessage {
    /// of the sender or, in a gateway, of the receiver; 0: the master
    std::uint16_t station = 0;
    std::uint8_t channel = 0;
    std::uint8_t priority = 0;
    MailboxType type{};
    std::uint8_t counter = 0;   ///< 1..7, 0: not counted
    std::span<const std::uint8_t> payload;
};

/// Reads a mailbox; nullopt if the length does not fit. Accepts any bytes. [realtime]
inline std::optional<MailboxMessage> read_mailbox(std::span<const std::uint8_t> bytes) noexcept {
    if (bytes.size() < mailbox_header_bytes) return std::nullopt;
    const std::size_t length = get<std::uint16_t>(bytes.data());
    if (length > bytes.size() - mailbox_header_bytes) return std::nullopt;
    MailboxMessage m;
    m.station = get<std::uint16_t>(bytes.data() + 2);
    m.channel = bytes[4] & 0x3f;
    m.priority = bytes[4] >> 6;
    m.type = static_cast<MailboxType>(bytes[5] & 0x0f);
    m.counter = bytes[5] >> 4 & 7;
    m.payload = bytes.subspan(mailbox_header_bytes, length);
    return m;
}
/// Writes the header of a message whose payload of `length` bytes follows it. [realtime]
inline void write_mailbox_header(std::uint8_t* to, std::size_t length, std::uint16_t station,
                                 MailboxType type, std::uint8_t counter) noexcept {
    put(to, static_cast<std::uint16_t>(length));
    put(to + 2, station);
    to[4] = 0;
    to[5] = static_cast<std::uint8_t>(static_cast<unsigned>(type) | (counter & 7U) << 4);
}
/// Returns the counter of the next message: 1..7. [any]
constexpr std::uint8_t next_mailbox_counter(std::uint8_t counter) noexcept {
    return counter >= 7 ? 1 : static_cast<std::uint8_t>(counter + 1);
}

/// Codes of a mailbox error (type 0). Its payload is u16 1, u16 code.
enum class MailboxError : std::uint16_t {
    syntax = 1,
    protocol_not_supported = 2,
    invalid_channel = 3,
    service_not_supported = 4,
    invalid_header = 5,
    too_short = 6,
    no_memory = 7,
    invalid_size = 8,
    service_in_work = 9
};
inline constexpr std::size_t mailbox_error_bytes = 4;
/// Returns the meaning of a mailbox error, as in "protocol not supported". [any]
constexpr const char* to_string(MailboxError error) noexcept {
    constexpr const char* words[] = {"invalid error code",     "syntax error",
                                     "protocol not supported", "invalid channel",
                                     "service not supported",  "invalid mailbox header",
                                     "message too short",      "no memory in the slave",
                                     "inconsistent size",      "service already in progress"};
    const auto n = static_cast<unsigned>(error);
    return words[n <= 9 ? n : 0];
}
/// Returns the code of a mailbox error; nullopt if the payload is not one. [realtime]
inline std::optional<MailboxError> read_mailbox_error(
    std::span<const std::uint8_t> payload) noexcept {
    if (payload.size() < mailbox_error_bytes ||
        (get<std::uint16_t>(payload.data()) & 0x7fff) != 1) {
        return std::nullopt;
    }
    return static_cast<MailboxError>(get<std::uint16_t>(payload.data() + 2));
}
/// Writes the payload of a mailbox error; returns its length. [realtime]
inline std::size_t write_mailbox_error(std::uint8_t* to, MailboxError error) noexcept {
    put<std::uint16_t>(to, 1);
    put(to + 2, static_cast<std::uint16_t>(error));
    return mailbox_error_bytes;
}

/// The header of VoE: vendor and type; then data.
inline constexpr std::size_t voe_header_bytes = 6;
struct VoeHeader {
    std::uint32_t vendor = 0;
    std::uint16_t type = 0;
};
/// Reads the header of VoE; nullopt if the payload is too short. [realtime]
inline std::optional<VoeHeader> read_voe(std::span<const std::uint8_t> payload) noexcept {
    if (payload.size() < voe_header_bytes) return std::nullopt;
    return VoeHeader{get<std::uint32_t>(payload.data()), get<std::uint16_t>(payload.data() + 4)};
}
/// Writes the header of VoE. [realtime]
inline void write_voe(std::uint8_t* to, VoeHeader h) noexcept {
    put(to, h.vendor);
    put(to + 4, h.type);
}

}  // namespace hal::ethercat
