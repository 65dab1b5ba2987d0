// SPDX-License-Identifier: MIT
#include "cane_format.hpp"

#include <array>
#include <cstring>

namespace hal::can::cane {

namespace {

// Flags beside the identifier, as in the 32-bit identifiers of SocketCAN and RTCAN.
constexpr std::uint32_t extended_bit = 0x8000'0000;
constexpr std::uint32_t remote_bit = 0x4000'0000;

constexpr std::uint32_t error_bit = 0x2000'0000;
constexpr std::uint32_t id_bits = 0x1fff'ffff;
constexpr unsigned remote_flag = 1U << 11;
constexpr unsigned long_form = 15;

constexpr auto crc_table = [] {
    std::array<std::uint16_t, 256> table{};
    for (unsigned byte = 0; byte < 256; ++byte) {
        unsigned crc = byte << 8;
        for (int bit = 0; bit < 8; ++bit) {
            crc = (crc & 0x8000) != 0 ? crc << 1 ^ 0x1021 : crc << 1;
        }
        table[byte] = static_cast<std::uint16_t>(crc);
    }
    return table;
}();

void put16(std::uint8_t* to, unsigned v) noexcept {
    to[0] = static_cast<std::uint8_t>(v);
    to[1] = static_cast<std::uint8_t>(v >> 8);
}
constexpr auto check_at = ethernet::header_bytes + 8;

void put64(std::uint8_t* to, std::uint64_t v) noexcept {
    for (unsigned n = 0; n < 8; ++n) {
        to[n] = static_cast<std::uint8_t>(v >> 8 * n);
    }
}
std::uint64_t get64(const std::uint8_t* from) noexcept {
    std::uint64_t v = 0;
    for (unsigned n = 8; n-- > 0;) {
        v = v << 8 | from[n];
    }
    return v;
}
unsigned get16(const std::uint8_t* from) noexcept { return from[0] | unsigned{from[1]} << 8; }

std::uint32_t word_of(const Frame& f) noexcept {
    const std::uint32_t extended = f.extended ? extended_bit : 0;
    const std::uint32_t remote = f.remote ? remote_bit : 0;
    return f.id | extended | remote;
}

/// Decodes identifier, flags and length. Returns false when they are invalid.
bool fill(std::uint32_t word, unsigned length, Frame& f) noexcept {
    f = {};
    f.id = word & id_bits;
    f.extended = (word & extended_bit) != 0;

    f.remote = (word & remote_bit) != 0;
    f.length = static_cast<std::uint8_t>(length);
    return length <= 8 && (word & error_bit) == 0 && f.valid();
}

/// Returns the end of a message, or nullptr when it is truncated or invalid. Sets all of `f` but
/// the data.
const std::uint8_t* head(const std::uint8_t* at, const std::uint8_t* end, Frame& f,
                         Wrong& wrong) noexcept {
    wrong = Wrong::cut;
    if (end - at < 2) return nullptr;
    const unsigned first = get16(at);
    const unsigned length = first >> 12;
    at += 2;
    std::uint32_t word = (first & 0x7ff) | ((first & remote_flag) != 0 ? remote_bit : 0);
    unsigned bytes = length;
    if (length == long_form) {
        if (end - at < 5) return nullptr;
        word = get16(at) | std::uint32_t{get16(at + 2)} << 16;
        bytes = at[4];
        at += 5;
    }
    if (!fill(word, bytes, f) || (length == long_form && (first & 0xfff) != 0)) {
        wrong = Wrong::form;
        return nullptr;
    }
    if (static_cast<std::size_t>(end - at) < f.bytes().size()) return nullptr;
    wrong = Wrong::none;
    return at;
}

}  // namespace

std::uint16_t crc16(std::span<const std::uint8_t> bytes, std::uint16_t crc) noexcept {
    for (const auto b : bytes) {
        crc = static_cast<std::uint16_t>(crc << 8 ^ crc_table[crc >> 8 ^ b]);
    }
    return crc;
}

std::size_t put_single(const Frame& f, Order order, std::span<std::uint8_t> out) noexcept {
    const auto data = f.bytes();
    if (!f.valid() || f.fd || out.size() < single_bytes + data.size()) return 0;
    const auto word = word_of(f);
    for (unsigned n = 0; n < 4; ++n) {
        out[n] = static_cast<std::uint8_t>(word >> 8 * (order == Order::big ? 3 - n : n));
    }
    out[4] = f.length;
    if (!data.empty()) {
        std::memcpy(out.data() + single_bytes, data.data(), data.size());
    }
    return single_bytes + data.size();
}

Wrong get_single(std::span<const std::uint8_t> payload, Order order, Frame& f) noexcept {
    if (payload.size() < single_bytes) return Wrong::cut;
    if (payload[0] == packed_marker && payload[3] == packed_marker) return Wrong::version;
    std::uint32_t word = 0;
    for (unsigned n = 0; n < 4; ++n) {
        word |= std::uint32_t{payload[n]} << 8 * (order == Order::big ? 3 - n : n);
    }
    if (!fill(word, payload[4], f)) return Wrong::form;
    const auto bytes = f.bytes().size();
    if (payload.size() - single_bytes < bytes) return Wrong::cut;
    if (bytes != 0) {
        std::memcpy(f.data.data(), payload.data() + single_bytes, bytes);
    }
    return Wrong::none;
}

std::size_t put_packed(const Frame& f, std::span<std::uint8_t> out) noexcept {
    const auto data = f.bytes();
    const std::size_t before = f.extended ? 7 : 2;
    if (!f.valid() || f.fd || out.size() < before + data.size()) return 0;
    if (f.extended) {
        const auto word = word_of(f);
        put16(out.data(), long_form << 12);
        put16(out.data() + 2, word & 0xffff);
        put16(out.data() + 4, word >> 16);
        out[6] = f.length;
    } else {
        put16(out.data(), f.id | (f.remote ? remote_flag : 0) | unsigned{f.length} << 12);
    }
    if (!data.empty()) {
        std::memcpy(out.data() + before, data.data(), data.size());
    }
    return before + data.size();
}

void begin_packed(std::span<std::uint8_t> whole, std::uint8_t messages, std::uint16_t session,
                  bool is_signed) noexcept {
    auto* h = whole.data() + ethernet::header_bytes;
    h[0] = h[3] = packed_marker;
    h[1] = is_signed ? signed_version : packed_version;

    h[2] = messages;
    put16(h + 4, session);
    put16(h + 6, 0);
    put16(h + 8, 0);
}

void finish_packed(std::span<std::uint8_t> whole, std::uint16_t sequence, std::uint64_t counter,
                   const Key* key) noexcept {
    auto* h = whole.data() + ethernet::header_bytes;
    put16(h + 6, sequence);
    const auto messages = key != nullptr ? whole.first(whole.size() - tag_bytes) : whole;
    if (key != nullptr) {
        put64(h + packed_header, counter);
    }
    put16(h + 8, crc16(messages.subspan(check_at + 2), crc16(messages.first(check_at))));
    if (key != nullptr) {
        put64(whole.data() + messages.size(), siphash(*key, messages));
    }
}

void close_packed(std::span<std::uint8_t> whole, std::uint8_t messages, Stamp stamp) noexcept {
    begin_packed(whole, messages, stamp.session, false);
    finish_packed(whole, stamp.sequence, 0, nullptr);
}

bool is_service(std::span<const std::uint8_t> whole) noexcept {
    return whole.size() >= ethernet::header_bytes + packed_header &&
           (get16(whole.data() + ethernet::header_bytes + 4) & services_alone) != 0;
}

Wrong Unpacker::open(std::span<const std::uint8_t> whole, const Key* key) noexcept {
    if (whole.size() < ethernet::header_bytes + packed_header) return Wrong::cut;
    const auto* h = whole.data() + ethernet::header_bytes;
    if (h[0] != packed_marker || h[3] != packed_marker) {
        return key != nullptr ? Wrong::not_signed : Wrong::version;
    }
    if (h[1] != (key != nullptr ? signed_version : packed_version)) {
        return key != nullptr && h[1] == packed_version ? Wrong::not_signed : Wrong::version;
    }
    messages_ = left_ = h[2];
    stamp_ = {static_cast<std::uint16_t>(get16(h + 4)), static_cast<std::uint16_t>(get16(h + 6))};
    const std::size_t header = packed_header + (key != nullptr ? counter_bytes : 0);
    if (whole.size() < ethernet::header_bytes + header) return Wrong::cut;
    const auto *const begin = h + header, *const end = whole.data() + whole.size();
    const auto* at = begin;
    for (unsigned n = 0; n < messages_; ++n) {
        Frame f;
        Wrong wrong{};
        const auto* data = head(at, end, f, wrong);
        if (data == nullptr) return wrong;
        at = data + f.bytes().size();
    }
    rest_ = {begin, at};
    const std::span<const std::uint8_t> signed_part(whole.data(), at);
    if (crc16(signed_part.subspan(check_at + 2), crc16(whole.first(check_at))) != get16(h + 8)) {
        return Wrong::check;
    }
    if (key == nullptr) return Wrong::none;
    if (static_cast<std::size_t>(end - at) < tag_bytes) return Wrong::cut;
    counter_ = get64(h + packed_header);
    return siphash(*key, signed_part) == get64(at) ? Wrong::none : Wrong::tag;
}

bool Unpacker::next(Frame& f) noexcept {
    if (left_ == 0) return false;
    Wrong wrong{};
    const auto* data = head(rest_.data(), rest_.data() + rest_.size(), f, wrong);
    if (data == nullptr) {
        left_ = 0;
        return false;
    }
    const auto bytes = f.bytes().size();
    if (bytes != 0) {
        std::memcpy(f.data.data(), data, bytes);
    }
    rest_ = rest_.subspan(static_cast<std::size_t>(data - rest_.data()) + bytes);
    --left_;
    return true;
}

}  // namespace hal::can::cane
