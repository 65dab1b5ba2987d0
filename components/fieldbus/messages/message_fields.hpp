// SPDX-License-Identifier: MIT
// The data of one CAN message as pins: fields one after the other, little endian.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <string>
#include <variant>

#include "field_values.hpp"
#include "hal/component.hpp"

namespace hal::messages {

enum class Kind : std::uint8_t { bit, u8, s8, u16, s16, u32, s32, f32, f64 };

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
    }
    const Field* begin() const noexcept { return fields_.data(); }
    const Field* end() const noexcept { return fields_.data() + count_; }
    std::uint8_t bytes() const noexcept { return bytes_; }  ///< of data in the message

private:
    static constexpr std::size_t most = 8;

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
    [[noreturn]] static void fail(const std::string& why) {
        throw hal::ArgumentError("fields", "fields: " + why);
    }

    std::array<Field, most> fields_;
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

/// One pin per field; `P` is hal::In or hal::Out.
template <template <class> class P>
class FieldPins {
public:
    FieldPins(hal::Component& component, const Layout& layout, const char* doc) {
        for (const Field& f : layout) {
            Slot& slot = slots_[count_++];
            slot.field = f;
            const std::string text = std::string(doc) + " (" + type_name(f.kind) + ")";
            switch (f.kind) {
            case Kind::bit:
                slot.pin.template emplace<P<bool>>(component, f.name.c_str(), text.c_str());
                break;
            case Kind::u8:
            case Kind::u16:
            case Kind::u32:
                slot.pin.template emplace<P<std::uint32_t>>(component, f.name.c_str(),
                                                            text.c_str());
                break;
            case Kind::s8:
            case Kind::s16:
            case Kind::s32:
                slot.pin.template emplace<P<std::int32_t>>(component, f.name.c_str(), text.c_str());
                break;
            default:
                slot.pin.template emplace<P<double>>(component, f.name.c_str(), text.c_str());
                break;
            }
        }
    }
    /// Stores the values; those out of a field's range are limited to it. [realtime]
    void store(std::uint8_t* to) const noexcept {
        for (std::size_t i = 0; i < count_; ++i) {
            const Field& f = slots_[i].field;
            std::uint64_t raw = 0;
            if (const auto* b = std::get_if<P<bool>>(&slots_[i].pin)) {
                raw = b->get() ? 1 : 0;
            } else if (const auto* u = std::get_if<P<std::uint32_t>>(&slots_[i].pin)) {
                raw = unsigned_bits(u->get(), f.bytes);
            } else if (const auto* s = std::get_if<P<std::int32_t>>(&slots_[i].pin)) {
                raw = signed_bits(s->get(), f.bytes);
            } else if (const auto* r = std::get_if<P<double>>(&slots_[i].pin)) {
                raw = f.kind == Kind::f64 ? std::bit_cast<std::uint64_t>(r->get())
                                          : single_bits(r->get());
            }
            for (unsigned n = 0; n < f.bytes; ++n) {
                to[f.offset + n] = static_cast<std::uint8_t>(raw >> (8 * n));
            }
        }
    }
    /// Sets the pins from data that is long enough. [realtime]
    void load(const std::uint8_t* from) noexcept {
        for (std::size_t i = 0; i < count_; ++i) {
            const Field& f = slots_[i].field;
            std::uint64_t raw = 0;
            for (unsigned n = 0; n < f.bytes; ++n) {
                raw |= std::uint64_t{from[f.offset + n]} << (8 * n);
            }
            if (auto* b = std::get_if<P<bool>>(&slots_[i].pin)) {
                *b = (raw & 1) != 0;
            } else if (auto* u = std::get_if<P<std::uint32_t>>(&slots_[i].pin)) {
                *u = static_cast<std::uint32_t>(raw);
            } else if (auto* s = std::get_if<P<std::int32_t>>(&slots_[i].pin)) {
                const unsigned unused = 64 - 8 * f.bytes;
                *s = static_cast<std::int32_t>(static_cast<std::int64_t>(raw << unused) >> unused);
            } else if (auto* r = std::get_if<P<double>>(&slots_[i].pin)) {
                *r = f.kind == Kind::f64
                         ? std::bit_cast<double>(raw)
                         : double{std::bit_cast<float>(static_cast<std::uint32_t>(raw))};
            }
        }
    }

private:
    struct Slot {
        Field field;
        std::variant<std::monostate, P<bool>, P<std::uint32_t>, P<std::int32_t>, P<double>> pin;
    };
    static const char* type_name(Kind kind) noexcept {
        for (const KindRow& row : kinds) {
            if (row.kind == kind) return row.name;
        }
        return "";
    }

    std::array<Slot, 8> slots_;
    std::size_t count_ = 0;
};

}  // namespace hal::messages
