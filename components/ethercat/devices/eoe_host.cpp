// SPDX-License-Identifier: MIT
// Ethernet over EtherCAT of the device with every protocol: ARP (RFC 826) and echo (RFC 792), no
// options and no fragments of IP.
#include "ethercat/devices/eoe_host.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace hal::ethercat::devices {

namespace {

constexpr std::size_t ethernet_bytes = 14;
constexpr std::size_t arp_bytes = 28;
constexpr std::size_t ip_bytes = 20;
constexpr std::size_t echo_bytes = 8;
constexpr std::uint16_t type_ip = 0x0800;
constexpr std::uint16_t type_arp = 0x0806;
constexpr std::uint8_t echo_request = 8;
constexpr std::uint8_t echo_reply = 0;
constexpr std::uint8_t protocol_icmp = 1;

std::uint16_t big16(const std::uint8_t* from) noexcept {
    return static_cast<std::uint16_t>(from[0] << 8 | from[1]);
}
std::uint32_t big32(const std::uint8_t* from) noexcept {
    return std::uint32_t{big16(from)} << 16 | big16(from + 2);
}
void put_big16(std::uint8_t* to, unsigned value) noexcept {
    to[0] = static_cast<std::uint8_t>(value >> 8);
    to[1] = static_cast<std::uint8_t>(value);
}
void put_big32(std::uint8_t* to, std::uint32_t value) noexcept {
    put_big16(to, value >> 16);
    put_big16(to + 2, value & 0xffff);
}

/// Returns the sum of the Internet checksum (RFC 1071); 0 where a checksum is included and right.
std::uint16_t checksum(const std::uint8_t* from, std::size_t bytes) noexcept {
    std::uint32_t sum = 0;
    for (std::size_t n = 0; n + 1 < bytes; n += 2) {
        sum += big16(from + n);
    }
    if (bytes % 2 != 0) {
        sum += static_cast<std::uint32_t>(from[bytes - 1] << 8);
    }
    while (sum > 0xffff) {
        sum = (sum & 0xffff) + (sum >> 16);
    }
    return static_cast<std::uint16_t>(~sum);
}

/// Turns an ARP request for `address` into its reply, RFC 826. Returns the bytes of the Ethernet
/// frame; 0: no such request.
std::size_t answer_arp(std::uint8_t* packet, std::size_t length, std::uint32_t address,
                       const std::array<std::uint8_t, 6>& mac) noexcept {
    // Ethernet, IPv4, lengths of addresses, request
    constexpr std::uint8_t request[8] = {0, 1, 8, 0, 6, 4, 0, 1};
    if (length < ethernet_bytes + arp_bytes) return 0;
    if (std::memcmp(packet, request, sizeof request) != 0) return 0;
    if (big32(packet + 24) != address) return 0;
    packet[7] = 2;                             // reply
    std::memcpy(packet + 18, packet + 8, 10);  // to the sender of the request
    std::memcpy(packet + 8, mac.data(), 6);
    put_big32(packet + 14, address);
    return ethernet_bytes + arp_bytes;
}

/// Returns the length of an IPv4 packet without options or fragments that has an ICMP echo request
/// to `address`, with correct checksums; 0: it is something else.
std::size_t echo_request_bytes(const std::uint8_t* packet, std::size_t length,
                               std::uint32_t address) noexcept {
    constexpr std::uint16_t fragment = 0x3fff;  // more of them, or an offset
    if (length < ethernet_bytes + ip_bytes + echo_bytes) return 0;
    const std::size_t total = big16(packet + 2);
    if (total < ip_bytes + echo_bytes || ethernet_bytes + total > length) return 0;
    const bool is_plain_icmp =
        packet[0] == 0x45 && (big16(packet + 6) & fragment) == 0 && packet[9] == protocol_icmp;
    if (!is_plain_icmp || big32(packet + 16) != address) return 0;
    const std::uint8_t* const echo = packet + ip_bytes;
    const bool is_whole = checksum(packet, ip_bytes) == 0 && checksum(echo, total - ip_bytes) == 0;
    return is_whole && echo[0] == echo_request ? total : 0;
}

/// Turns an ICMP echo request to `address` into its reply, RFC 792. Returns the bytes of the
/// Ethernet frame; 0: no such request.
std::size_t answer_echo(std::uint8_t* packet, std::size_t length, std::uint32_t address) noexcept {
    const std::size_t total = echo_request_bytes(packet, length, address);
    if (total == 0) return 0;
    std::memcpy(packet + 16, packet + 12, 4);
    put_big32(packet + 12, address);
    packet[8] = 64;  // time to live
    put_big16(packet + 10, 0);
    put_big16(packet + 10, checksum(packet, ip_bytes));
    std::uint8_t* const echo = packet + ip_bytes;
    echo[0] = echo_reply;
    put_big16(echo + 2, 0);
    put_big16(echo + 2, checksum(echo, total - ip_bytes));
    return ethernet_bytes + total;
}

}  // namespace

std::size_t EoeHost::answer(std::size_t length) noexcept {
    constexpr std::size_t min_frame = 60;
    std::uint8_t* const frame = frame_.data();
    std::uint8_t* const packet = frame + ethernet_bytes;
    if (length < ethernet_bytes || ip_.address == 0) return 0;
    const bool is_group = (frame[0] & 1) != 0;
    if (!is_group && std::memcmp(frame, ip_.mac.data(), 6) != 0) return 0;
    std::size_t bytes = 0;
    switch (big16(frame + 12)) {
    case type_arp: bytes = answer_arp(packet, length, ip_.address, ip_.mac); break;
    case type_ip: bytes = answer_echo(packet, length, ip_.address); break;
    default: return 0;
    }
    if (bytes == 0) return 0;
    std::memcpy(frame, frame + 6, 6);
    std::memcpy(frame + 6, ip_.mac.data(), 6);
    if (bytes < min_frame) {
        std::memset(frame + bytes, 0, min_frame - bytes);
    }
    return std::max(bytes, min_frame);
}

void EoeHost::take(const MailboxMessage& message, State, Outbox& out) noexcept {
    const auto h = eoe::read(message.payload);
    if (!h) {
        return out.send(MailboxType::error,
                        write_mailbox_error(out.payload(), MailboxError::too_short));
    }
    eoe::Header header;
    header.port = h->port;
    header.last = true;
    const auto respond = [&](eoe::Type type, eoe::Result result) {
        header.type = type;
        header.word = static_cast<std::uint16_t>(result);
        eoe::write(out.payload(), header);
        out.send(MailboxType::eoe, eoe::header_bytes);
    };
    switch (h->type) {
    case eoe::Type::fragment: {
        const auto frame = joiner_.take(message.payload);
        if (frame.empty() || !splitter_.done()) {
            return;  // one answer at a time
        }
        std::memcpy(frame_.data(), frame.data(), frame.size());
        if (const std::size_t length = answer(frame.size()); length != 0) {
            splitter_ = eoe::Splitter({frame_.data(), length}, ++number_, out.mailbox(), h->port);
        }
        return;
    }
    case eoe::Type::set_ip:
        if (const auto ip = eoe::read_ip(message.payload.subspan(eoe::header_bytes))) {
            ip_ = *ip;
            return respond(eoe::Type::set_ip_response, eoe::Result::ok);
        }
        return respond(eoe::Type::set_ip_response, eoe::Result::unspecified);
    case eoe::Type::get_ip:
        header.type = eoe::Type::get_ip_response;
        eoe::write(out.payload(), header);
        out.send(MailboxType::eoe,
                 eoe::header_bytes + eoe::write_ip(out.payload() + eoe::header_bytes, ip_));
        return;
    case eoe::Type::set_filter:
        return respond(eoe::Type::set_filter_response, eoe::Result::no_filter);
    case eoe::Type::get_filter:
        return respond(eoe::Type::get_filter_response, eoe::Result::no_filter);
    default: return;
    }
}

void EoeHost::pump(Outbox& out) noexcept {
    if (const auto length = splitter_.next(out.payload())) {
        out.send(MailboxType::eoe, length);
    }
}

}  // namespace hal::ethercat::devices
