// SPDX-License-Identifier: MIT
#include "tunnel.hpp"

#include <algorithm>

#include "fieldbus/tdma/wire/big_endian.hpp"

namespace hal::tdma {

namespace {

constexpr std::uint16_t min_type = 0x0600;
constexpr std::uint16_t ipv4 = 0x0800;
constexpr std::uint16_t arp = 0x0806;
constexpr std::uint16_t ipv6 = 0x86dd;

constexpr std::size_t max_payload_size =
    ethernet::max_frame - ethernet::header_bytes - rtmac_bytes;

bool is_group(const Address& a) noexcept { return (a[0] & 1) != 0; }

/// Returns true when the packet has the length in its header (RFC 791, 826, 8200); padding may
/// follow.
bool is_whole(std::uint16_t type, std::span<const std::uint8_t> p) noexcept {
    switch (type) {
    case ipv4: {
        if (p.size() < 20 || p[0] >> 4 != 4) return false;
        const std::size_t header = std::size_t{p[0] & 15U} * 4U;
        const std::size_t total = get<std::uint16_t>(p, 2);
        return header >= 20 && total >= header && total <= p.size();
    }
    case arp: return p.size() >= 28;
    case ipv6:
        return p.size() >= 40 && p[0] >> 4 == 6 &&
               std::size_t{40} + get<std::uint16_t>(p, 4) <= p.size();
    default: return true;
    }
}

}  // namespace

bool is_packet(const Decoded& d, const Address& own) noexcept {
    if (d.kind != Kind::tunnelled || (d.to != own && !is_group(d.to)) || d.from == own ||
        is_group(d.from)) {
        return false;
    }
    if (d.tunnelled.payload.size() > max_payload_size) return false;
    const std::uint16_t type = d.tunnelled.type;
    return type >= min_type && type != rtmac_type && type != rtcfg_type && type != cane_type &&
           is_whole(type, d.tunnelled.payload);
}

std::size_t tunnel_mtu(const StationSetup& setup) noexcept {
    for (const SlotSetup& s : setup.slots) {
        if (s.id == tunnel_slot) return tunnel_mtu(s.size);
    }
    return 0;
}

Tunnel::Tunnel(Station& station) : station_(station), mtu_(tunnel_mtu(station.setup())) {}

void Tunnel::arrived(std::span<const std::uint8_t> frame, Time) noexcept {
    if (!is_packet(decode(frame), station_.address())) return count(rejected_);
    Packet* place = in_.place();
    if (place == nullptr) return count(dropped_in_);
    std::copy(frame.begin(), frame.end(), place->bytes.begin());
    place->length = frame.size();
    in_.commit();
    count(received_);
}

void Tunnel::before_slots(Time now) noexcept {
    mtu_.store(tunnel_mtu(station_.setup()), std::memory_order_relaxed);
    // Called once a cycle while the station is running.
    if (now - last_ > 2 * station_.setup().cycle) {
        for (; out_.front() != nullptr; out_.drop()) {
            count(dropped_old_);
        }
    }
    last_ = now;
    if (mtu() == 0) return;
    for (const Packet* p = nullptr; (p = out_.front()) != nullptr; out_.drop()) {
        const auto sent = station_.send({p->bytes.data(), p->length}, tunnel_slot, last_priority);
        if (sent == ethernet::Sent::full) {
            break;  // until the next turn
        }
        count(sent == ethernet::Sent::queued ? sent_ : dropped_old_);
    }
}

bool Tunnel::give(std::span<const std::uint8_t> frame) noexcept {
    Packet* place =
        open() && frame.size() <= ethernet::header_bytes + mtu() ? out_.place() : nullptr;
    if (place != nullptr) {
        place->length = tunnel(frame, place->bytes);
    }
    if (place == nullptr || place->length == 0) {
        count(dropped_out_);
        return false;
    }
    out_.commit();
    return true;
}

std::size_t Tunnel::take(std::span<std::uint8_t> out) noexcept {
    const Packet* p = in_.front();
    if (p == nullptr) return 0;
    const std::size_t length = untunnel({p->bytes.data(), p->length}, out);
    in_.drop();
    return length;
}

}  // namespace hal::tdma
