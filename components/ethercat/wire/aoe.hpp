// SPDX-License-Identifier: MIT
// ADS over EtherCAT (ETG.1020): the AMS header and the services of ADS. All offsets are from the
// start of the payload of the mailbox.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "ethercat/wire/mailbox.hpp"
#include "text/text_table.hpp"

namespace hal::ethercat::aoe {

inline constexpr std::size_t header_bytes = 32;
enum class Command : std::uint16_t {
    device_info = 1,
    read = 2,
    write = 3,
    read_state = 4,
    write_control = 5,
    add_notification = 6,
    delete_notification = 7,
    notification = 8,
    read_write = 9
};
inline constexpr std::uint16_t request_flags = 0x0004;
inline constexpr std::uint16_t response_flags = 0x0005;

using NetId = std::array<std::uint8_t, 6>;
struct Header {
    NetId target{};
    std::uint16_t target_port = 0;
    NetId source{};
    std::uint16_t source_port = 0;
    Command command{};
    std::uint16_t flags = request_flags;
    std::uint32_t length = 0;  ///< of the data that follows
    std::uint32_t error = 0;
    std::uint32_t invoke = 0;  ///< id of the request, copied to the response
    bool response() const noexcept { return (flags & 1) != 0; }
};
/// Reads the header; nullopt if the payload is too short for it or its data. [realtime]
inline std::optional<Header> read(std::span<const std::uint8_t> payload) noexcept {
    if (payload.size() < header_bytes) return std::nullopt;
    const std::uint8_t* at = payload.data();
    Header h;
    std::memcpy(h.target.data(), at, 6);
    h.target_port = get<std::uint16_t>(at + 6);
    std::memcpy(h.source.data(), at + 8, 6);
    h.source_port = get<std::uint16_t>(at + 14);
    h.command = static_cast<Command>(get<std::uint16_t>(at + 16));

    h.flags = get<std::uint16_t>(at + 18);
    h.length = get<std::uint32_t>(at + 20);
    h.error = get<std::uint32_t>(at + 24);

    h.invoke = get<std::uint32_t>(at + 28);
    if (h.length > payload.size() - header_bytes) return std::nullopt;
    return h;
}
/// Writes the header. [realtime]
inline void write(std::uint8_t* to, const Header& h) noexcept {
    std::memcpy(to, h.target.data(), 6);
    put(to + 6, h.target_port);
    std::memcpy(to + 8, h.source.data(), 6);
    put(to + 14, h.source_port);
    put(to + 16, static_cast<std::uint16_t>(h.command));
    put(to + 18, h.flags);
    put(to + 20, h.length);
    put(to + 24, h.error);
    put(to + 28, h.invoke);
}
/// Returns the header of the response to a request, with `length` bytes of data. [realtime]
inline Header response_to(const Header& request, std::uint32_t length,
                          std::uint32_t error = 0) noexcept {
    Header h = request;
    h.target = request.source;
    h.target_port = request.source_port;
    h.source = request.target;

    h.source_port = request.target_port;
    h.flags = response_flags;
    h.length = length;
    h.error = error;
    return h;
}

// read: u32 group, u32 offset, u32 length; response u32 result, u32 length, data. write: u32 group,
// u32 offset, u32 length, data; response u32 result. read_state: response u32 result, u16 ADS
// state, u16 device state. device_info: response u32 result, u8 major, u8 minor, u16 build, 16
// characters.
inline constexpr std::size_t address_bytes = 12;
inline constexpr std::size_t read_response_bytes = 8;
inline constexpr std::size_t write_response_bytes = 4;
inline constexpr std::uint32_t group_sdo = 0xf302;
inline constexpr std::uint32_t group_soe = 0xf420;
/// Returns the offset of an object in group_sdo. [any]
constexpr std::uint32_t sdo_offset(std::uint16_t index, std::uint8_t sub,
                                   bool complete = false) noexcept {
    return static_cast<std::uint32_t>(index) << 16 | (complete ? 0x100U : 0U) | sub;
}

namespace error {
inline constexpr std::uint32_t none = 0;
inline constexpr std::uint32_t no_port = 6;
inline constexpr std::uint32_t no_machine = 7;
inline constexpr std::uint32_t unknown_command = 8;

inline constexpr std::uint32_t device = 0x700;
inline constexpr std::uint32_t unsupported = 0x701;
inline constexpr std::uint32_t group = 0x702;
inline constexpr std::uint32_t offset = 0x703;

inline constexpr std::uint32_t access = 0x704;
inline constexpr std::uint32_t size = 0x705;
inline constexpr std::uint32_t data = 0x706;
inline constexpr std::uint32_t not_ready = 0x707;

inline constexpr std::uint32_t busy = 0x708;
inline constexpr std::uint32_t context = 0x709;
inline constexpr std::uint32_t memory = 0x70a;
inline constexpr std::uint32_t parameter = 0x70b;

inline constexpr std::uint32_t not_found = 0x70c;
inline constexpr std::uint32_t timeout = 0x745;
}  // namespace error
/// Returns the meaning of an ADS error; nullptr for others, which may be SDO abort codes. [any]
constexpr const char* error_text(std::uint32_t code) noexcept {
    constexpr TextRow<std::uint32_t> rows[] = {
        {error::none, "ok"},
        {error::no_port, "target port not found"},
        {error::no_machine, "target machine not found"},
        {error::unknown_command, "unknown command"},
        {error::device, "device error"},
        {error::unsupported, "service not supported"},
        {error::group, "invalid index group"},
        {error::offset, "invalid index offset"},
        {error::access, "access denied"},
        {error::size, "invalid size"},
        {error::data, "invalid data"},
        {error::not_ready, "device not ready"},
        {error::busy, "device busy"},
        {error::context, "invalid context"},
        {error::memory, "out of memory"},
        {error::parameter, "invalid parameter"},
        {error::not_found, "not found"},
        {error::timeout, "timeout"},
    };
    return find_text(rows, code, nullptr);
}

}  // namespace hal::ethercat::aoe
