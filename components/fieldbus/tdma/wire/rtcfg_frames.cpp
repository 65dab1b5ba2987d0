// SPDX-License-Identifier: MIT
#include "rtcfg_frames.hpp"

#include <algorithm>

#include "big_endian.hpp"

namespace hal::tdma::rtcfg {

namespace {

/// Reads fields from the front; a missing field makes it fail.
class Taker {
public:
    explicit Taker(std::span<const std::uint8_t> bytes) noexcept : bytes_(bytes) {}
    bool good() const noexcept { return good_; }
    template <class T>
    T number() noexcept {
        if (!has(sizeof(T))) {
            return {};
        }
        const T value = get<T>(bytes_, 0);
        bytes_ = bytes_.subspan(sizeof(T));
        return value;
    }
    std::span<const std::uint8_t> take(std::size_t count) noexcept {
        if (!has(count)) {
            return {};
        }
        const auto part = bytes_.first(count);
        bytes_ = bytes_.subspan(count);
        return part;
    }
    std::span<const std::uint8_t> rest() const noexcept { return bytes_; }
    std::size_t left() const noexcept { return bytes_.size(); }

private:
    bool has(std::size_t count) noexcept { return good_ = good_ && bytes_.size() >= count; }
    std::span<const std::uint8_t> bytes_;
    bool good_ = true;
};

/// Appends fields; one that does not fit makes it fail.
class Putter {
public:
    explicit Putter(std::span<std::uint8_t> bytes) noexcept : bytes_(bytes) {}
    template <class T>
    void number(T value) noexcept {
        if (fits(sizeof(T))) {
            put(bytes_, at_, value);
            at_ += sizeof(T);
        }
    }
    void bytes(std::span<const std::uint8_t> data) noexcept {
        if (fits(data.size())) {
            std::copy(data.begin(), data.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(at_));

            at_ += data.size();
        }
    }
    std::size_t length() const noexcept { return good_ ? at_ : 0; }

private:
    bool fits(std::size_t count) noexcept { return good_ = good_ && at_ + count <= bytes_.size(); }
    std::span<std::uint8_t> bytes_;
    std::size_t at_ = 0;
    bool good_ = true;
};

constexpr std::size_t physical_bytes = 32;

bool parse_logical(Taker& t, std::uint8_t type, Logical& out) noexcept {
    out = {type == 1, {}};
    if (type > 1) return false;
    if (out.by_ip) {
        const auto ip = t.take(4);
        if (!t.good()) return false;
        std::copy(ip.begin(), ip.end(), out.ip.begin());
    }
    return true;
}

void put_logical(Putter& p, const Logical& l) noexcept {
    if (l.by_ip) {
        p.bytes(l.ip);
    }
}

}  // namespace

bool decode(std::span<const std::uint8_t> frame, Message& m) noexcept {
    if (frame.size() < ethernet::header_bytes + 1 || get<std::uint16_t>(frame, 12) != rtcfg_type) {
        return false;
    }
    m = {};
    std::copy_n(frame.begin(), 6, m.to.begin());
    std::copy_n(frame.begin() + 6, 6, m.from.begin());
    // bits 5..7: a version to be ignored
    const std::uint8_t id = frame[ethernet::header_bytes] & 0x1f;
    if (id >= ids) return false;
    m.id = static_cast<Id>(id);
    Taker t(frame.subspan(ethernet::header_bytes + 1));
    switch (m.id) {
    case Id::stage_1: {
        const auto type = t.number<std::uint8_t>();
        if (!parse_logical(t, type, m.client) || !parse_logical(t, type, m.server)) return false;
        m.burst = t.number<std::uint8_t>();
        m.length = t.number<std::uint16_t>();
        m.data = t.take(m.length);
        break;
    }
    case Id::announce_new:
    case Id::announce_reply:
        if (!parse_logical(t, t.number<std::uint8_t>(), m.client)) return false;
        m.flags = t.number<std::uint8_t>();
        m.burst = t.number<std::uint8_t>();  // of a reply: padding
        break;
    case Id::stage_2:
        m.flags = t.number<std::uint8_t>();
        m.active = t.number<std::uint32_t>();
        m.heartbeat_ms = t.number<std::uint16_t>();
        m.length = t.number<std::uint32_t>();
        m.data = t.rest().first(std::min<std::size_t>(t.left(), m.length));
        break;
    case Id::stage_2_fragment:
        m.offset = t.number<std::uint32_t>();
        m.data = t.rest();
        break;
    case Id::acknowledge: m.length = t.number<std::uint32_t>(); break;
    case Id::ready:
    case Id::heartbeat: break;
    case Id::dead_station: {
        if (!parse_logical(t, t.number<std::uint8_t>(), m.client)) return false;
        const auto physical = t.take(physical_bytes);
        if (t.good()) {
            std::copy_n(physical.begin(), 6, m.dead.begin());
        }
        break;
    }
    }
    return t.good();
}

std::size_t encode(const Message& m, std::span<std::uint8_t> out) noexcept {
    Putter p(out);
    p.bytes(m.to);
    p.bytes(m.from);
    p.number(rtcfg_type);
    p.number(static_cast<std::uint8_t>(m.id));
    const auto type = static_cast<std::uint8_t>(m.client.by_ip ? 1 : 0);
    switch (m.id) {
    case Id::stage_1:
        if (m.data.size() > UINT16_MAX) return 0;
        p.number(type);
        put_logical(p, m.client);
        put_logical(p, {m.client.by_ip, m.server.ip});
        p.number(m.burst);
        p.number(static_cast<std::uint16_t>(m.data.size()));
        p.bytes(m.data);
        break;
    case Id::announce_new:
    case Id::announce_reply:
        p.number(type);
        put_logical(p, m.client);
        p.number(m.flags);
        p.number(m.id == Id::announce_new ? m.burst : std::uint8_t{0});
        break;
    case Id::stage_2:
        p.number(m.flags);
        p.number(m.active);
        p.number(m.heartbeat_ms);
        p.number(m.length);
        p.bytes(m.data);
        break;
    case Id::stage_2_fragment:
        p.number(m.offset);
        p.bytes(m.data);
        break;
    case Id::acknowledge: p.number(m.length); break;
    case Id::ready:
    case Id::heartbeat: break;
    case Id::dead_station: {
        p.number(type);
        put_logical(p, m.client);
        std::array<std::uint8_t, physical_bytes> physical{};
        std::copy(m.dead.begin(), m.dead.end(), physical.begin());
        p.bytes(physical);
        break;
    }
    }
    const std::size_t length = p.length();
    if (length == 0 || length >= ethernet::smallest_frame) return length;
    if (out.size() < ethernet::smallest_frame) return 0;
    std::fill(out.begin() + static_cast<std::ptrdiff_t>(length),
              out.begin() + ethernet::smallest_frame, std::uint8_t{0});
    return ethernet::smallest_frame;
}

}  // namespace hal::tdma::rtcfg
