// SPDX-License-Identifier: MIT
// Ethernet over EtherCAT (ETG.1000.6, clause 5.7). All offsets are from the start of the payload of
// the mailbox.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "ethercat/wire/mailbox.hpp"

namespace hal::ethercat::eoe {

inline constexpr std::size_t header_bytes = 4;
inline constexpr std::size_t max_frame = 1522;  ///< with two VLAN tags, without check sequence
enum class Type : std::uint8_t {
    fragment = 0,
    timestamp = 1,
    set_ip = 2,
    set_ip_response = 3,
    set_filter = 4,
    set_filter_response = 5,
    get_ip = 6,
    get_ip_response = 7,
    get_filter = 8,
    get_filter_response = 9
};
/// Results in the second word of responses.
enum class Result : std::uint16_t {
    ok = 0,
    unspecified = 1,
    unsupported = 2,
    no_ip = 0x0201,
    no_dhcp = 0x0202,
    no_filter = 0x0401
};
/// Returns the meaning of a result. [any]
constexpr const char* to_string(Result result) noexcept {
    switch (result) {
    case Result::ok: return "ok";
    case Result::unspecified: return "unspecified error";
    case Result::unsupported: return "frame type not supported";
    case Result::no_ip: return "IP settings not supported";
    case Result::no_dhcp: return "DHCP not supported";
    case Result::no_filter: return "address filter not supported";
    }
    return "unknown result";
}

struct Header {
    Type type = Type::fragment;
    std::uint8_t port = 0;  ///< 0: any
    bool last = false;  ///< last fragment
    bool timestamp = false;
    bool timestamp_requested = false;
    std::uint16_t word = 0;  ///< second word: the three fields below, or a result

    std::uint8_t fragment() const noexcept { return word & 0x3f; }
    /// Returns the bytes of the whole frame, rounded up (fragment 0), or the offset of a fragment.
    /// A hint only.
    std::size_t bytes() const noexcept { return (word >> 6 & 0x3fU) * 32U; }
    std::uint8_t frame() const noexcept { return static_cast<std::uint8_t>(word >> 12); }
};
/// Reads the header; nullopt if the payload is too short. [realtime]
inline std::optional<Header> read(std::span<const std::uint8_t> payload) noexcept {
    if (payload.size() < header_bytes) return std::nullopt;
    const unsigned info = get<std::uint16_t>(payload.data());
    Header h;
    h.type = static_cast<Type>(info & 0x0f);
    h.port = info >> 4 & 0x0f;
    h.last = (info & 0x100) != 0;
    h.timestamp = (info & 0x200) != 0;

    h.timestamp_requested = (info & 0x400) != 0;
    h.word = get<std::uint16_t>(payload.data() + 2);
    return h;
}
/// Writes the header. [realtime]
inline void write(std::uint8_t* to, const Header& h) noexcept {
    const unsigned flags = static_cast<unsigned>(h.last) << 8 |
                           static_cast<unsigned>(h.timestamp) << 9 |
                           static_cast<unsigned>(h.timestamp_requested) << 10;
    put(to,
        static_cast<std::uint16_t>(static_cast<unsigned>(h.type) | (h.port & 0x0fU) << 4 | flags));
    put(to + 2, h.word);
}
/// Returns the second word of a fragment. [any]
constexpr std::uint16_t fragment_word(unsigned fragment, std::size_t offset_or_frame_bytes,
                                      unsigned frame) noexcept {
    return static_cast<std::uint16_t>(
        (fragment & 0x3f) | ((offset_or_frame_bytes + 31) / 32 & 0x3f) << 6 | (frame & 0x0f) << 12);
}
/// Returns the data bytes of a fragment that is not the last: a multiple of 32. [any]
constexpr std::size_t fragment_capacity(std::size_t mailbox) noexcept {
    return (mailbox - mailbox_header_bytes - header_bytes) / 32 * 32;
}

/// Splits a frame: `while (auto length = splitter.next(payload)) send(length)`.
class Splitter {
public:
    Splitter() = default;
    /// `frame` without check sequence; `number` counts modulo 16; `mailbox` in bytes.
    Splitter(std::span<const std::uint8_t> frame, unsigned number, std::size_t mailbox,
             std::uint8_t port = 0) noexcept
        : frame_(frame), capacity_(fragment_capacity(mailbox)), number_(number), port_(port) {}
    bool done() const noexcept { return at_ >= frame_.size(); }
    /// Writes the payload of the next fragment; returns its length, 0 at the end. [realtime]
    std::size_t next(std::uint8_t* to) noexcept {
        if (done() || capacity_ == 0) return 0;
        const std::size_t length = std::min(capacity_, frame_.size() - at_);
        Header h;
        h.port = port_;
        h.last = at_ + length == frame_.size();
        h.word = fragment_word(fragment_, at_ == 0 ? frame_.size() : at_, number_);
        write(to, h);
        std::memcpy(to + header_bytes, frame_.data() + at_, length);
        at_ += length;
        ++fragment_;
        return header_bytes + length;
    }

private:
    std::span<const std::uint8_t> frame_;
    std::size_t at_ = 0;
    std::size_t capacity_ = 0;
    unsigned fragment_ = 0;
    unsigned number_ = 0;
    std::uint8_t port_ = 0;
};

/// Joins fragments to a frame. A gap drops the frame.
class Joiner {
public:
    /// Takes the payload of a fragment; returns the frame when it is complete, else an empty span.
    /// Accepts any bytes. [realtime]
    std::span<const std::uint8_t> take(std::span<const std::uint8_t> payload) noexcept {
        const auto h = read(payload);
        if (!h || h->type != Type::fragment) {
            return {};
        }
        auto data = payload.subspan(header_bytes);
        if (h->last && h->timestamp) {
            data = data.first(data.size() >= 4 ? data.size() - 4 : 0);
        }
        if (h->fragment() == 0) {
            used_ = 0;
            expected_ = 0;
            frame_ = h->frame();
            active_ = true;
        }
        const bool follows = active_ && h->fragment() == expected_ && h->frame() == frame_ &&
                             (h->fragment() == 0 || h->bytes() == used_);
        if (!follows || data.size() > bytes_.size() - used_) {
            dropped_ += active_ ? 1 : 0;
            active_ = false;
            return {};
        }
        if (!data.empty()) {
            std::memcpy(bytes_.data() + used_, data.data(), data.size());
        }
        used_ += data.size();
        ++expected_;
        if (!h->last) {
            return {};
        }
        active_ = false;
        return {bytes_.data(), used_};
    }
    /// Returns the number of incomplete frames.
    std::uint32_t dropped() const noexcept { return dropped_; }

private:
    std::array<std::uint8_t, max_frame> bytes_{};
    std::size_t used_ = 0;
    std::uint32_t dropped_ = 0;
    unsigned expected_ = 0;
    std::uint8_t frame_ = 0;
    bool active_ = false;
};

/// Settings of a slave's IP stack. Addresses are u32 in host order: C0A8020Ah is 192.168.2.10, as
/// they travel.
struct Ip {
    std::uint32_t flags = 0;  ///< fields that are set, below
    std::array<std::uint8_t, 6> mac{};
    std::uint32_t address = 0;
    std::uint32_t mask = 0;
    std::uint32_t gateway = 0;
    std::uint32_t dns = 0;
    std::array<char, 32> name{};
};
namespace ip_flag {
inline constexpr std::uint32_t mac = 1;
inline constexpr std::uint32_t address = 2;
inline constexpr std::uint32_t mask = 4;
inline constexpr std::uint32_t gateway = 8;
inline constexpr std::uint32_t dns = 16;
inline constexpr std::uint32_t name = 32;
}  // namespace ip_flag
inline constexpr std::size_t max_ip = 4 + 6 + 16 + 32;  ///< bytes after the header
/// Writes the fields that are set, in order and packed, up to the last one; returns their length
/// with the flags. [realtime]
inline std::size_t write_ip(std::uint8_t* to, const Ip& ip) noexcept {
    put(to, ip.flags);
    std::uint8_t* at = to + 4;
    const auto word = [&](std::uint32_t flag, std::uint32_t value) {
        if ((ip.flags & flag) != 0) {
            put(at, value);
            at += 4;
        }
    };
    if ((ip.flags & ip_flag::mac) != 0) {
        std::memcpy(at, ip.mac.data(), 6);
        at += 6;
    }
    word(ip_flag::address, ip.address);
    word(ip_flag::mask, ip.mask);

    word(ip_flag::gateway, ip.gateway);
    word(ip_flag::dns, ip.dns);
    if ((ip.flags & ip_flag::name) != 0) {
        std::memcpy(at, ip.name.data(), ip.name.size());
        at += ip.name.size();
    }
    return static_cast<std::size_t>(at - to);
}
/// Reads settings, `data` after the header; nullopt if they are too short. All fields may be
/// present though not set. [realtime]
inline std::optional<Ip> read_ip(std::span<const std::uint8_t> data) noexcept {
    if (data.size() < 4) return std::nullopt;
    Ip ip;
    ip.flags = get<std::uint32_t>(data.data()) & 0x3f;
    // some masters send all fields, whatever the flags
    const bool fixed = data.size() >= max_ip;
    std::size_t at = 4;
    bool ok = true;
    const auto field = [&](std::uint32_t flag, void* to, std::size_t bytes) {
        if ((ip.flags & flag) == 0 && !fixed) return;
        if (at + bytes > data.size()) {
            ok = ok && (ip.flags & flag) == 0;
        } else {
            std::memcpy(to, data.data() + at, bytes);
            at += bytes;
        }
    };
    field(ip_flag::mac, ip.mac.data(), 6);
    field(ip_flag::address, &ip.address, 4);

    field(ip_flag::mask, &ip.mask, 4);
    field(ip_flag::gateway, &ip.gateway, 4);
    field(ip_flag::dns, &ip.dns, 4);

    field(ip_flag::name, ip.name.data(), ip.name.size());
    if (!ok) return std::nullopt;
    return ip;
}

}  // namespace hal::ethercat::eoe
