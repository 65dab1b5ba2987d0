// SPDX-License-Identifier: MIT
// The data of one CAN message as pins: fields one after the other, little endian.
#pragma once

#include <algorithm>
#include <array>
#include <string>

#include "field_pins.hpp"

namespace hal::messages {

enum class Kind : std::uint8_t { bit, u8, s8, u16, s16, u32, s32, f32, f64 };

/// Name of the counter of messages with NaN or infinity.
inline constexpr const char* invalid_pin = "invalid";

struct KindRow {
    const char* name;
    Kind kind;
    std::uint8_t bytes;
};
inline constexpr KindRow kinds[] = {
    {"bit", Kind::bit, 1}, {"u8", Kind::u8, 1},   {"s8", Kind::s8, 1},
    {"u16", Kind::u16, 2}, {"s16", Kind::s16, 2}, {"u32", Kind::u32, 4},
    {"s32", Kind::s32, 4}, {"f32", Kind::f32, 4}, {"f64", Kind::f64, 8}};

struct Field {
    std::string name;
    Kind kind;
    std::uint8_t offset, bytes;
};

/// The fields of `fields=NAME:TYPE,NAME:TYPE`, at most 8 bytes.
class Layout {
public:
    /// Throws hal::ArgumentError with the reason. [setup]
    explicit Layout(const std::string& text) {
        for (std::size_t at = 0; at < text.size();) {
            const std::size_t end = std::min(text.find(',', at), text.size());
            add(text.substr(at, end - at));
            at = end + 1;
        }
        check_counter();
    }
    const Field* begin() const noexcept { return fields_.data(); }
    const Field* end() const noexcept { return fields_.data() + count_; }
    std::uint8_t bytes() const noexcept { return bytes_; }  ///< of data in the message

private:
    static constexpr std::size_t max = 8;

    void add(const std::string& one) {
        const auto colon = one.find(':');
        if (colon == std::string::npos || colon == 0) {
            fail("'" + one + "' is not NAME:TYPE; write for example position:s32,speed:s16");
        }
        const std::string name = one.substr(0, colon);
        const std::string type = one.substr(colon + 1);
        for (const char c : name) {
            if (!(c == '-' || (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'))) {
                fail("invalid name '" + name + "'; use a to z, 0 to 9 and '-'");
            }
        }
        for (const Field& f : *this) {
            if (f.name == name) {
                fail("duplicate field '" + name + "'; choose another name");
            }
        }
        for (const KindRow& row : kinds) {
            if (type != row.name) continue;
            if (bytes_ + row.bytes > 8) {
                fail("more than 8 bytes at field '" + name + "'; split it into two messages");
            }
            fields_[count_++] = {name, row.kind, bytes_, row.bytes};
            bytes_ = static_cast<std::uint8_t>(bytes_ + row.bytes);
            return;
        }
        fail("unknown type '" + type + "' of field '" + name +
             "'; types are bit, u8, s8, u16, s16, u32, s32, f32, f64");
    }
    /// Real fields have a counter, whose pin has this name.
    void check_counter() const {
        const auto is_real = [](const Field& f) {
            return f.kind == Kind::f32 || f.kind == Kind::f64;
        };
        const auto is_counter = [](const Field& f) { return f.name == invalid_pin; };
        if (std::any_of(begin(), end(), is_real) && std::any_of(begin(), end(), is_counter)) {
            fail("reserved name 'invalid': a message with f32 or f64 counts invalid values in this "
                 "pin; choose another name");
        }
    }
    [[noreturn]] static void fail(const std::string& why) {
        throw hal::ArgumentError("fields", "fields: " + why);
    }

    std::array<Field, max> fields_;
    std::size_t count_ = 0;
    std::uint8_t bytes_ = 0;
};

/// Returns the identifier of `id=`, or throws: decimal or 0x hexadecimal, `last` further ones must
/// exist. [setup]
inline std::uint32_t identifier(std::int64_t id, std::int64_t last) {
    if (id <= 0x7ff && id + last > 0x7ff) {
        throw hal::ArgumentError("id", "id: identifiers " + std::to_string(id) + ".." +
                                           std::to_string(id + last) +
                                           " are of both formats; stay below 0x800 or start above");
    }
    if (id + last > 0x1fffffff) {
        throw hal::ArgumentError(
            "id", "id: identifier " + std::to_string(id + last) + " is above 0x1fffffff");
    }
    return static_cast<std::uint32_t>(id);
}

/// The pins of a layout.
template <hal_dir direction>
class LayoutPins : public FieldPins<direction> {
public:
    LayoutPins(hal::Component& component, const Layout& layout, const char* doc) {
        for (const Field& f : layout) {
            this->declare(component, nullptr, f.name,
                          std::string(doc) + " (" + type_name(f.kind) + ")", f.offset, codec_of(f));
        }
    }

private:
    static const char* type_name(Kind kind) noexcept {
        for (const KindRow& row : kinds) {
            if (row.kind == kind) return row.name;
        }
        return "";
    }
    static PinCodec codec_of(const Field& field) noexcept {
        using Format = PinCodec::Format;
        const unsigned bits = 8U * field.bytes;
        switch (field.kind) {
        case Kind::bit: return {Format::unsigned_integer, 1};
        case Kind::s8:
        case Kind::s16:
        case Kind::s32: return {Format::signed_integer, bits};
        case Kind::f32:
        case Kind::f64: return {Format::real, bits};
        default: return {Format::unsigned_integer, bits};
        }
    }
};

}  // namespace hal::messages
