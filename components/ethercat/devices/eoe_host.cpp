// SPDX-License-Identifier: MIT
// Ethernet over EtherCAT of the device with every protocol: ARP (RFC 826) and echo (RFC 792), no
// options and no fragments of IP.
#include "ethercat/devices/eoe_host.hpp"

#include <algorithm>
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

}  // namespace

std::size_t EoeHost::answer(std::size_t length) noexcept {
    std::uint8_t* const frame = frame_.data();
    std::uint8_t* const packet = frame + ethernet_bytes;
    const bool group = (frame[0] & 1) != 0;
    const bool own = std::memcmp(frame, ip_.mac.data(), 6) == 0;
    if (length < ethernet_bytes || ip_.address == 0 || (!group && !own)) return 0;
    std::size_t bytes = 0;
    if (big16(frame + 12) == type_arp && length >= ethernet_bytes + arp_bytes) {
        // Ethernet, IPv4, lengths of addresses, request
        constexpr std::uint8_t request[8] = {0, 1, 8, 0, 6, 4, 0, 1};
        if (std::memcmp(packet, request, sizeof request) != 0 ||
            big32(packet + 24) != ip_.address) {
            return 0;
        }
        packet[7] = 2;
        std::memcpy(packet + 18, packet + 8, 10);  // the asker's addresses
        std::memcpy(packet + 8, ip_.mac.data(), 6);
        put_big32(packet + 14, ip_.address);
        bytes = ethernet_bytes + arp_bytes;
    } else if (big16(frame + 12) == type_ip && length >= ethernet_bytes + ip_bytes + echo_bytes) {
        const std::size_t total = big16(packet + 2);
        std::uint8_t* const echo = packet + ip_bytes;
        const bool fits =
            packet[0] == 0x45 && total >= ip_bytes + echo_bytes && ethernet_bytes + total <= length;
        if (!fits || (big16(packet + 6) & 0x3fff) != 0 || packet[9] != protocol_icmp ||
            big32(packet + 16) != ip_.address) {
            return 0;
        }
        if (checksum(packet, ip_bytes) != 0 || checksum(echo, total - ip_bytes) != 0 ||
            echo[0] != echo_request) {
            return 0;
        }
        std::memcpy(packet + 16, packet + 12, 4);
        put_big32(packet + 12, ip_.address);
        packet[8] = 64;  // time to live
        put_big16(packet + 10, 0);
        put_big16(packet + 10, checksum(packet, ip_bytes));
        echo[0] = echo_reply;
        put_big16(echo + 2, 0);
        put_big16(echo + 2, checksum(echo, total - ip_bytes));
        bytes = ethernet_bytes + total;
    } else {
        return 0;
    }
    std::memcpy(frame, frame + 6, 6);
    std::memcpy(frame + 6, ip_.mac.data(), 6);
    constexpr std::size_t smallest = 60;
    if (bytes < smallest) {
        std::memset(frame + bytes, 0, smallest - bytes);
    }
    return std::max(bytes, smallest);
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
