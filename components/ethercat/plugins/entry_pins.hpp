// SPDX-License-Identifier: MIT
// Entries of the process data as pins. Declared in the component's constructor; the cycle moves
// numbers only.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <deque>
#include <span>
#include <string>

#include "ethercat/master/setup.hpp"
#include "hal/component.hpp"

namespace hal::ethercat {

/// Reads `bits` (1..64) at a bit offset, least significant first. [realtime]
inline std::uint64_t bits_of(std::span<const std::uint8_t> data, std::size_t at,
                             unsigned bits) noexcept {
    std::uint64_t value = 0;
    for (unsigned done = 0; done < bits;) {
        const std::size_t byte = (at + done) / 8;
        const std::size_t shift = (at + done) % 8;
        const unsigned take = std::min<unsigned>(static_cast<unsigned>(8 - shift), bits - done);
        value |= (static_cast<std::uint64_t>(data[byte] >> shift) & ((1U << take) - 1)) << done;
        done += take;
    }
    return value;
}
/// Writes `bits` (1..64) at a bit offset and leaves all other bits. [realtime]
inline void set_bits(std::span<std::uint8_t> data, std::size_t at, unsigned bits,
                     std::uint64_t value) noexcept {
    for (unsigned done = 0; done < bits;) {
        const std::size_t byte = (at + done) / 8;
        const std::size_t shift = (at + done) % 8;
        const unsigned take = std::min<unsigned>(static_cast<unsigned>(8 - shift), bits - done);
        const auto mask = static_cast<std::uint8_t>(((1U << take) - 1) << shift);
        data[byte] =
            static_cast<std::uint8_t>((data[byte] & ~mask) | ((value >> done << shift) & mask));
        done += take;
    }
}
/// Extends the sign of a number of `bits`. [realtime]
inline std::int64_t signed_of(std::uint64_t raw, unsigned bits) noexcept {
    const unsigned shift = 64 - bits;
    return static_cast<std::int64_t>(raw << shift) >> shift;
}

/// The pins of all entries that have a name.
class EntryPins {
public:
    /// Inputs of the slaves are shown by the one function, outputs taken by the other. [setup]
    EntryPins(Component& component, const Function& shows, const Function& takes)
        : component_(component), shows_(shows), takes_(takes) {}

    /// Declares the pin of an entry at bit `at` of its process data. `prefix` ends with a dot.
    /// [setup]
    void declare(const std::string& prefix, const master::Entry& e, bool output, std::size_t area,
                 std::size_t at) {
        if (e.name.empty() || e.bits == 0 || e.bits > 64) return;
        const std::string name = prefix + e.name;
        const Place place{area,
                          at,
                          e.bits,
                          e.type,
                          e.is_signed || is_signed(e.type),
                          e.scaled ? e.scale : 1.0,
                          e.scaled ? e.offset : 0.0};
        if (e.scaled || e.type == master::Type::real32 || e.type == master::Type::real64) {
            return add(name, e, output, place, in_real_, out_real_);
        }
        if (e.type == master::Type::bit && e.bits > 1) {
            for (unsigned bit = 0; bit < e.bits; ++bit) {
                Place one = place;
                one.at += bit;
                one.bits = 1;
                add(name + "-" + std::to_string(bit), e, output, one, in_bit_, out_bit_);
            }
            return;
        }
        if (e.type == master::Type::bit || e.bits == 1) {
            return add(name, e, output, place, in_bit_, out_bit_);
        }
        if (e.bits > 32 && place.is_signed) return add(name, e, output, place, in_s64_, out_s64_);
        if (e.bits > 32) return add(name, e, output, place, in_u64_, out_u64_);
        if (place.is_signed) return add(name, e, output, place, in_s32_, out_s32_);
        add(name, e, output, place, in_u32_, out_u32_);
    }

    /// Copies inputs of the slaves to pins. `areas`: process data by number. [realtime]
    void show(std::span<const std::span<std::uint8_t>> areas) noexcept {
        for (auto& b : out_bit_) {
            b.pin = raw(areas, b.place) != 0;
        }
        for (auto& b : out_u32_) {
            b.pin = static_cast<std::uint32_t>(raw(areas, b.place));
        }
        for (auto& b : out_s32_) {
            b.pin = static_cast<std::int32_t>(signed_of(raw(areas, b.place), b.place.bits));
        }
        for (auto& b : out_u64_) {
            b.pin = raw(areas, b.place);
        }
        for (auto& b : out_s64_) {
            b.pin = signed_of(raw(areas, b.place), b.place.bits);
        }
        for (auto& b : out_real_) {
            b.pin = real_of(raw(areas, b.place), b.place) * b.place.scale + b.place.offset;
        }
    }
    /// Copies pins to outputs of the slaves, limited to the range of the entry. [realtime]
    void take(std::span<const std::span<std::uint8_t>> areas) noexcept {
        for (auto& b : in_bit_) {
            store(areas, b.place, b.pin ? 1 : 0);
        }
        for (auto& b : in_u32_) {
            store(areas, b.place, std::min<std::uint64_t>(b.pin.get(), most(b.place)));
        }
        for (auto& b : in_u64_) {
            store(areas, b.place, std::min<std::uint64_t>(b.pin.get(), most(b.place)));
        }
        for (auto& b : in_s32_) {
            store(areas, b.place, limited(b.place, b.pin.get()));
        }
        for (auto& b : in_s64_) {
            store(areas, b.place, limited(b.place, b.pin.get()));
        }
        for (auto& b : in_real_) {
            const double value = (b.pin - b.place.offset) / b.place.scale;
            // otherwise the last one stays
            if (std::isfinite(value)) {
                store(areas, b.place, of_real(value, b.place));
            }
        }
    }

private:
    struct Place {
        std::size_t area = 0;
        std::size_t at = 0;
        unsigned bits = 0;
        master::Type type{};
        bool is_signed = false;
        double scale = 1.0;
        double offset = 0.0;
    };
    template <class Pin>
    struct Bound {
        Pin pin;
        Place place;
        template <class T>
        Bound(Component& component, const Function& function, const std::string& name,
              const std::string& about, hal::PinOptions<T> options, const Place& place_)
            : pin(component, function, name.c_str(), about.c_str(), options), place(place_) {}
    };

    static bool is_signed(master::Type type) noexcept {
        return type == master::Type::s8 || type == master::Type::s16 || type == master::Type::s32 ||
               type == master::Type::s64;
    }
    template <class T>
    void add(const std::string& name, const master::Entry& e, bool output, const Place& place,
             std::deque<Bound<In<T>>>& ins, std::deque<Bound<Out<T>>>& outs) {
        char about[48];
        std::snprintf(about, sizeof about, "object 0x%04X:%u, %u bits", e.index, e.sub, e.bits);
        if (output) {
            ins.emplace_back(component_, takes_, name, about, hal::PinOptions<T>{}, place);
        } else {
            outs.emplace_back(component_, shows_, name, about, hal::PinOptions<T>{}, place);
        }
    }
    static std::uint64_t raw(std::span<const std::span<std::uint8_t>> areas,
                             const Place& p) noexcept {
        return bits_of(areas[p.area], p.at, p.bits);
    }
    static void store(std::span<const std::span<std::uint8_t>> areas, const Place& p,
                      std::uint64_t value) noexcept {
        set_bits(areas[p.area], p.at, p.bits, value);
    }
    /// Returns the largest number of an entry.
    static std::uint64_t most(const Place& p) noexcept {
        const unsigned bits = p.is_signed ? p.bits - 1 : p.bits;
        return bits >= 64 ? UINT64_MAX : (std::uint64_t{1} << bits) - 1;
    }
    static std::uint64_t limited(const Place& p, std::int64_t value) noexcept {
        const auto high = static_cast<std::int64_t>(std::min<std::uint64_t>(most(p), INT64_MAX));
        return static_cast<std::uint64_t>(std::clamp(value, p.is_signed ? -high - 1 : 0, high));
    }
    static double real_of(std::uint64_t bits, const Place& p) noexcept {
        if (p.type == master::Type::real32) {
            const auto low = static_cast<std::uint32_t>(bits);
            float value = 0;
            std::memcpy(&value, &low, sizeof value);
            return std::isfinite(value) ? static_cast<double>(value) : 0.0;
        }
        if (p.type == master::Type::real64) {
            double value = 0;
            std::memcpy(&value, &bits, sizeof value);
            return std::isfinite(value) ? value : 0.0;
        }
        return p.is_signed ? static_cast<double>(signed_of(bits, p.bits))
                           : static_cast<double>(bits);
    }
    static std::uint64_t of_real(double value, const Place& p) noexcept {
        if (p.type == master::Type::real32) {
            const auto single = static_cast<float>(value);
            std::uint32_t bits = 0;
            std::memcpy(&bits, &single, sizeof bits);
            return bits;
        }
        if (p.type == master::Type::real64) {
            std::uint64_t bits = 0;
            std::memcpy(&bits, &value, sizeof bits);
            return bits;
        }
        const double rounded = std::nearbyint(value);
        const double high = static_cast<double>(most(p));
        if (rounded >= high) return most(p);
        if (!p.is_signed) return rounded <= 0.0 ? 0 : static_cast<std::uint64_t>(rounded);
        return limited(p, rounded <= -high - 1.0 ? INT64_MIN : static_cast<std::int64_t>(rounded));
    }

    Component& component_;
    const Function &shows_, &takes_;
    // Deques: a pin may not move once it is declared.
    std::deque<Bound<In<bool>>> in_bit_;
    std::deque<Bound<In<std::uint32_t>>> in_u32_;
    std::deque<Bound<In<std::int32_t>>> in_s32_;
    std::deque<Bound<In<std::uint64_t>>> in_u64_;
    std::deque<Bound<In<std::int64_t>>> in_s64_;
    std::deque<Bound<In<double>>> in_real_;
    std::deque<Bound<Out<bool>>> out_bit_;
    std::deque<Bound<Out<std::uint32_t>>> out_u32_;
    std::deque<Bound<Out<std::int32_t>>> out_s32_;
    std::deque<Bound<Out<std::uint64_t>>> out_u64_;
    std::deque<Bound<Out<std::int64_t>>> out_s64_;
    std::deque<Bound<Out<double>>> out_real_;
};

}  // namespace hal::ethercat
