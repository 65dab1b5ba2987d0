// SPDX-License-Identifier: MIT
// File access over EtherCAT (ETG.1000.6, clause 5.8). All offsets are from the start of the payload
// of the mailbox.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "ethercat/wire/mailbox.hpp"

namespace hal::ethercat::foe {

// u8 opcode, u8 0, u32 password, packet number or error; then the name, data or a text.
inline constexpr std::size_t header_bytes = 6;
enum class Opcode : std::uint8_t { read = 1, write = 2, data = 3, ack = 4, error = 5, busy = 6 };
/// Returns the data bytes of a full packet: a shorter packet ends the file. [any]
constexpr std::size_t packet_capacity(std::size_t mailbox) noexcept {
    return mailbox - mailbox_header_bytes - header_bytes;
}

struct Message {
    Opcode opcode{};
    /// password, packet number (the first is 1; 0 acknowledges a write request) or error code
    std::uint32_t value = 0;
    std::span<const std::uint8_t> data;  ///< file name, data or text
    std::string_view text() const noexcept {
        return {reinterpret_cast<const char*>(data.data()), data.size()};
    }
    /// Returns the progress of busy.
    std::uint16_t done() const noexcept { return static_cast<std::uint16_t>(value); }
    /// Returns the end of that progress, often
    std::uint16_t entire() const noexcept { return static_cast<std::uint16_t>(value >> 16); }
    ///< 100.
};
/// Reads a message; nullopt if the payload is too short. [realtime]
inline std::optional<Message> read(std::span<const std::uint8_t> payload) noexcept {
    if (payload.size() < header_bytes) return std::nullopt;
    return Message{static_cast<Opcode>(payload[0]), get<std::uint32_t>(payload.data() + 2),
                   payload.subspan(header_bytes)};
}
/// Writes the header of a message. [realtime]
inline void write_header(std::uint8_t* to, Opcode opcode, std::uint32_t value) noexcept {
    to[0] = static_cast<std::uint8_t>(opcode);
    to[1] = 0;
    put(to + 2, value);
}

enum class Error : std::uint32_t {
    not_defined = 0x8000,
    not_found = 0x8001,
    access_denied = 0x8002,
    disk_full = 0x8003,
    illegal = 0x8004,
    packet_number = 0x8005,
    already_exists = 0x8006,
    no_user = 0x8007,
    bootstrap_only = 0x8008,
    not_in_bootstrap = 0x8009,
    no_rights = 0x800a,
    program_error = 0x800b,
    checksum = 0x800c,
    wrong_firmware = 0x800d,
    no_file = 0x800f
};
/// Returns the meaning of an error, as in "file not found". Accepts codes without 8000h too. [any]
constexpr const char* to_string(Error error) noexcept {
    constexpr const char* words[] = {"unspecified error",
                                     "file not found",
                                     "access denied",
                                     "disk full",
                                     "illegal operation",
                                     "wrong packet number",
                                     "file already exists",
                                     "no user",
                                     "allowed in BOOT only",
                                     "not allowed in BOOT",
                                     "no rights (wrong password)",
                                     "program error",
                                     "wrong checksum",
                                     "firmware does not fit the hardware",
                                     "unknown error",
                                     "no file"};
    return words[static_cast<std::uint32_t>(error) & 0x0f];
}

}  // namespace hal::ethercat::foe
