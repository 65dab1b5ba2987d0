// SPDX-License-Identifier: MIT
#include "datagram.hpp"

#include <bit>
#include <cmath>
#include <cstring>
#include <string_view>

namespace hal::can::canudp {

namespace {

class Writer {
public:
    explicit Writer(Datagram& out) noexcept : out_(out) {}
    void byte(unsigned b) noexcept { out_[size_++] = static_cast<std::uint8_t>(b); }
    void big_endian(std::uint64_t v, unsigned bytes) noexcept {
        while (bytes-- > 0) {
            byte(static_cast<unsigned>(v >> bytes * 8 & 0xff));
        }
    }
    void key(std::string_view k) noexcept {
        byte(0xa0U | static_cast<unsigned>(k.size()));
        for (const char c : k) {
            byte(static_cast<unsigned char>(c));
        }
    }
    void flag(std::string_view k, bool v) noexcept {
        key(k);
        byte(v ? 0xc3 : 0xc2);
    }
    void number(std::string_view k, std::uint32_t v) noexcept {
        key(k);
        if (v < 0x80) {
            byte(v);
        } else if (v < 0x100) {
            byte(0xcc);
            byte(v);
        } else if (v < 0x10000) {
            byte(0xcd);
            big_endian(v, 2);
        } else {
            byte(0xce);
            big_endian(v, 4);
        }
    }
    std::size_t size() const noexcept { return size_; }

private:
    Datagram& out_;
    std::size_t size_ = 0;
};

/// A scalar value; for strings and binaries, their bytes.
struct Value {
    enum Kind { nothing, boolean, integer, real, bytes } kind = nothing;
    std::uint64_t number = 0;  ///< negative ones wrap to large ones
    std::span<const std::uint8_t> content;
};

class Reader {
public:
    explicit Reader(std::span<const std::uint8_t> in) noexcept : in_(in) {}
    bool big_endian(unsigned bytes, std::uint64_t& v) noexcept {
        if (in_.size() - at_ < bytes) return false;
        v = 0;
        while (bytes-- > 0) {
            v = v << 8 | in_[at_++];
        }
        return true;
    }
    bool entries(std::uint64_t& count) noexcept {
        std::uint64_t b = 0;
        if (!big_endian(1, b)) return false;
        if (b >> 4 == 8) {
            count = b & 15;
            return true;
        }
        return b == 0xde ? big_endian(2, count) : b == 0xdf && big_endian(4, count);
    }
    bool value(Value& v) noexcept {
        std::uint64_t b = 0;
        if (!big_endian(1, b)) return false;
        v = {};
        if (b < 0x80) {
            v.kind = Value::integer;
            v.number = b;
            return true;
        }
        if (b >= 0xe0) {
            v.kind = Value::integer;
            v.number = b - 0x100;
            return true;
        }
        if (b >> 5 == 5) return content(b & 31, v);
        switch (b) {
        case 0xc0: return true;
        case 0xc2:
        case 0xc3:
            v.kind = Value::boolean;
            v.number = b & 1;
            return true;
        case 0xc4:
        case 0xd9: return sized(1, v);
        case 0xc5:
        case 0xda: return sized(2, v);
        case 0xc6:
        case 0xdb: return sized(4, v);
        case 0xca: v.kind = Value::real; return big_endian(4, v.number);
        case 0xcb: v.kind = Value::real; return big_endian(8, v.number);
        case 0xcc:
        case 0xcd:
        case 0xce:
        case 0xcf: v.kind = Value::integer; return big_endian(1U << (b - 0xcc), v.number);
        case 0xd0:
        case 0xd1:
        case 0xd2:
        case 0xd3: {
            const unsigned bytes = 1U << (b - 0xd0);
            if (!big_endian(bytes, v.number)) return false;
            if (bytes < 8 && v.number >> (bytes * 8 - 1) != 0) {
                v.number -= std::uint64_t{1} << bytes * 8;
            }
            v.kind = Value::integer;
            return true;
        }
        default: return false;
        }
    }
    bool at_end() const noexcept { return at_ == in_.size(); }

private:
    bool sized(unsigned bytes, Value& v) noexcept {
        std::uint64_t size = 0;
        return big_endian(bytes, size) && content(size, v);
    }
    bool content(std::uint64_t size, Value& v) noexcept {
        if (in_.size() - at_ < size) return false;
        v.kind = Value::bytes;
        v.content = in_.subspan(at_, static_cast<std::size_t>(size));
        at_ += static_cast<std::size_t>(size);
        return true;
    }
    std::span<const std::uint8_t> in_;
    std::size_t at_ = 0;
};

}  // namespace

std::size_t encode(const Frame& f, std::int64_t real_time_ns, Datagram& out) noexcept {
    Writer w(out);
    w.byte(0x8b);
    w.key("timestamp");
    w.byte(0xcb);

    w.big_endian(std::bit_cast<std::uint64_t>(static_cast<double>(real_time_ns) * 1e-9), 8);
    w.number("arbitration_id", f.id);
    w.flag("is_extended_id", f.extended);
    w.flag("is_remote_frame", f.remote);
    w.flag("is_error_frame", f.error);
    w.key("channel");
    w.byte(0xc0);
    w.number("dlc", f.length);
    w.key("data");
    w.byte(0xc4);
    w.byte(static_cast<unsigned>(f.bytes().size()));
    for (const auto b : f.bytes()) {
        w.byte(b);
    }
    w.flag("is_fd", f.fd);
    w.flag("bitrate_switch", f.bit_rate_switch);
    w.flag("error_state_indicator", f.error_state);
    return w.size();
}

bool decode(std::span<const std::uint8_t> in, Frame& f) noexcept {
    Reader r(in);
    std::uint64_t count = 0;
    if (!r.entries(count) || count > 32) return false;
    f = {};
    bool has_id = false;
    std::uint64_t dlc = 65;
    std::span<const std::uint8_t> data;
    for (; count > 0; --count) {
        Value name, v;
        if (!r.value(name) || name.kind != Value::bytes || !r.value(v)) return false;
        const std::string_view key(reinterpret_cast<const char*>(name.content.data()),
                                   name.content.size());
        const auto flag = [&](bool& to) {
            return v.kind == Value::boolean && (to = v.number != 0, true);
        };
        bool right = true;
        if (key == "arbitration_id") {
            right = has_id = v.kind == Value::integer && v.number <= 0x1fffffff;
            f.id = static_cast<std::uint32_t>(v.number);
        } else if (key == "dlc") {
            right = v.kind == Value::integer && v.number <= 64;
            dlc = v.number;
        } else if (key == "data") {
            right = v.kind == Value::nothing || (v.kind == Value::bytes && v.content.size() <= 64);
            data = v.content;
        } else if (key == "is_extended_id") {
            right = flag(f.extended);
        } else if (key == "is_remote_frame") {
            right = flag(f.remote);
        } else if (key == "is_error_frame") {
            right = flag(f.error);
        } else if (key == "is_fd") {
            right = flag(f.fd);
        } else if (key == "bitrate_switch") {
            right = flag(f.bit_rate_switch);
        } else if (key == "error_state_indicator") {
            right = flag(f.error_state);
        }
        if (!right) return false;
    }
    if (!r.at_end() || !has_id || dlc > 64 || (f.remote ? !data.empty() : data.size() != dlc)) {
        return false;
    }
    f.length = static_cast<std::uint8_t>(dlc);
    if (!data.empty()) {
        std::memcpy(f.data.data(), data.data(), data.size());
    }
    if (f.error) return !f.fd && f.length <= 8;
    return f.valid();
}

}  // namespace hal::can::canudp
