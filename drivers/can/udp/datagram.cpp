// SPDX-License-Identifier: MIT
#include "datagram.hpp"

#include <array>
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

/// What follows the first byte of a value.
struct Form {
    enum Kind : std::uint8_t {
        invalid,
        nil,
        boolean,
        real,
        natural,
        integer,
        sized
    } kind = invalid;
    std::uint8_t bytes = 0;  ///< of the number, or of the size
};

/// The forms of the first bytes 0xc0 to 0xdf. Arrays, maps and extensions are invalid here.
constexpr std::array<Form, 32> forms = {{
    {Form::nil, 0},     {Form::invalid, 0}, {Form::boolean, 0}, {Form::boolean, 0},  // c0
    {Form::sized, 1},   {Form::sized, 2},   {Form::sized, 4},   {Form::invalid, 0},  // c4
    {Form::invalid, 0}, {Form::invalid, 0}, {Form::real, 4},    {Form::real, 8},     // c8
    {Form::natural, 1}, {Form::natural, 2}, {Form::natural, 4}, {Form::natural, 8},  // cc
    {Form::integer, 1}, {Form::integer, 2}, {Form::integer, 4}, {Form::integer, 8},  // d0
    {Form::invalid, 0}, {Form::invalid, 0}, {Form::invalid, 0}, {Form::invalid, 0},  // d4
    {Form::invalid, 0}, {Form::sized, 1},   {Form::sized, 2},   {Form::sized, 4},    // d8
    {Form::invalid, 0}, {Form::invalid, 0}, {Form::invalid, 0}, {Form::invalid, 0},  // dc
}};

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
        if (b == 0xde) return big_endian(2, count);
        return b == 0xdf && big_endian(4, count);
    }
    bool value(Value& v) noexcept {
        std::uint64_t first = 0;
        if (!big_endian(1, first)) return false;
        v = {};
        if (first < 0x80) return set_integer(first, v);
        if (first >= 0xe0) return set_integer(first - 0x100, v);
        if (first >= 0xc0) return formed(forms[first - 0xc0], first, v);
        const bool is_short_string = first >= 0xa0;
        return is_short_string && content(first & 31, v);
    }
    bool at_end() const noexcept { return at_ == in_.size(); }

private:
    static bool set_integer(std::uint64_t number, Value& v) noexcept {
        v.kind = Value::integer;
        v.number = number;
        return true;
    }
    bool formed(Form form, std::uint64_t first, Value& v) noexcept {
        switch (form.kind) {
        case Form::nil: return true;
        case Form::boolean:
            v.kind = Value::boolean;
            v.number = first & 1;
            return true;
        case Form::real: v.kind = Value::real; return big_endian(form.bytes, v.number);
        case Form::natural: v.kind = Value::integer; return big_endian(form.bytes, v.number);
        case Form::integer: return negative_or_not(form.bytes, v);
        case Form::sized: return sized(form.bytes, v);
        case Form::invalid: break;
        }
        return false;
    }
    bool negative_or_not(unsigned bytes, Value& v) noexcept {
        std::uint64_t number = 0;
        if (!big_endian(bytes, number)) return false;
        const bool negative = number >> (bytes * 8 - 1) != 0;
        if (negative && bytes < 8) {
            number -= std::uint64_t{1} << bytes * 8;
        }
        return set_integer(number, v);
    }
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

/// The keys of a map, as far as they are known.
struct Fields {
    Frame& frame;
    bool has_id = false;
    std::uint64_t dlc = 65;  ///< above 64: missing
    std::span<const std::uint8_t> data = {};
};

struct Flag {
    std::string_view key;
    bool Frame::* flag;
};
constexpr Flag flags[] = {
    {"is_extended_id", &Frame::extended},        {"is_remote_frame", &Frame::remote},
    {"is_error_frame", &Frame::error},           {"is_fd", &Frame::fd},
    {"bitrate_switch", &Frame::bit_rate_switch}, {"error_state_indicator", &Frame::error_state},
};

bool apply_id(const Value& v, Fields& fields) noexcept {
    fields.has_id = v.kind == Value::integer && v.number <= 0x1fffffff;
    fields.frame.id = static_cast<std::uint32_t>(v.number);
    return fields.has_id;
}

bool apply_data(const Value& v, Fields& fields) noexcept {
    fields.data = v.content;
    return v.kind == Value::nothing || (v.kind == Value::bytes && v.content.size() <= 64);
}

/// Returns false for a value that its key does not allow; true for an unknown key.
bool apply(std::string_view key, const Value& v, Fields& fields) noexcept {
    if (key == "arbitration_id") return apply_id(v, fields);
    if (key == "data") return apply_data(v, fields);
    if (key == "dlc") {
        fields.dlc = v.number;
        return v.kind == Value::integer && v.number <= 64;
    }
    for (const Flag& each : flags) {
        if (key != each.key) continue;
        fields.frame.*each.flag = v.number != 0;
        return v.kind == Value::boolean;
    }
    return true;
}

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
    Fields fields{f};
    for (; count > 0; --count) {
        Value name;
        Value value;
        if (!r.value(name) || name.kind != Value::bytes || !r.value(value)) return false;
        const std::string_view key(reinterpret_cast<const char*>(name.content.data()),
                                   name.content.size());
        if (!apply(key, value, fields)) return false;
    }
    if (!r.at_end() || !fields.has_id || fields.dlc > 64) return false;
    const std::size_t length = f.remote ? 0 : fields.dlc;
    if (fields.data.size() != length) return false;
    f.length = static_cast<std::uint8_t>(fields.dlc);
    if (!fields.data.empty()) {
        std::memcpy(f.data.data(), fields.data.data(), fields.data.size());
    }
    if (f.error) return !f.fd && f.length <= 8;
    return f.valid();
}

}  // namespace hal::can::canudp
