// SPDX-License-Identifier: MIT
// Entries of the process data as pins. Declared in the component's constructor; the cycle moves
// numbers only.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>

#include "ethercat/master/setup.hpp"
#include "ethercat/wire/byte_order.hpp"
#include "hal/any_pin.hpp"
#include "hal/pin_codec.hpp"

namespace hal::ethercat {

/// The pins of all entries that have a name.
class EntryPins {
public:
    /// Inputs of the slaves are shown by the one function, outputs taken by the other. [setup]
    EntryPins(Component& component, const Function& receive, const Function& transmit)
        : component_(component), receive_(receive), transmit_(transmit) {}

    /// Declares the pin of an entry at bit `at` of its process data. `prefix` ends with a dot.
    /// [setup]
    void declare(const std::string& prefix, const master::Entry& e, bool output, std::size_t area,
                 std::size_t at) {
        if (e.name.empty() || e.bits == 0 || e.bits > 64) return;
        const std::string name = prefix + e.pin_name();
        if (e.type == master::Type::bit && e.bits > 1 && !e.scaled) {
            for (unsigned bit = 0; bit < e.bits; ++bit) {
                add(name + "-" + std::to_string(bit), e, HAL_TYPE_BIT, output,
                    {area, at + bit, {PinCodec::Format::unsigned_integer, 1}});
            }
            return;
        }
        if ((is_real(e) || (output && e.scaled)) && !invalid_) {
            invalid_ = std::make_unique<Out<std::uint32_t>>(
                component_, receive_, "invalid",
                "real values that are not finite, of slaves and of input pins, counted in each "
                "cycle: the pin or the entry keeps the last finite value");
        }
        Place place{area, at, codec_of(e)};
        hal_type type = place.codec.pin_type();
        if (e.scaled) {
            type = HAL_TYPE_FLOAT;
            place.scale = e.scale;
            place.offset = e.offset;
        }
        add(name, e, type, output, place);
    }

    /// Copies inputs of the slaves to pins. A value that is not finite leaves its pin. `areas`:
    /// process data by number. [realtime]
    void show(std::span<const std::span<std::uint8_t>> areas) noexcept {
        std::uint32_t invalid = 0;
        outs_.each([areas, &invalid]<class T>(Out<T>& pin, const Place& p) noexcept {
            const T value = p.codec.decode<T>(p.read(areas[p.area]));
            if constexpr (std::is_same_v<T, double>) {
                if (!std::isfinite(value)) {
                    ++invalid;
                    return;
                }
                pin = value * p.scale + p.offset;
            } else {
                pin = value;
            }
        });
        invalid += transmitted_invalid_.exchange(0, std::memory_order_relaxed);
        if (invalid_ && invalid != 0) {
            *invalid_ = *invalid_ + invalid;
        }
    }
    /// Copies pins to outputs of the slaves, limited to the range of the entry. [realtime]
    /// Returns whether an input pin is not finite: its entry keeps the last value.
    bool transmit(std::span<const std::span<std::uint8_t>> areas) noexcept {
        std::uint32_t invalid = 0;
        ins_.each([areas, &invalid]<class T>(const In<T>& pin, const Place& p) noexcept {
            T value = pin.get();
            if constexpr (std::is_same_v<T, double>) {
                value = (value - p.offset) / p.scale;
                if (!std::isfinite(value)) {
                    ++invalid;
                    return;  // the last one stays
                }
            }
            p.write(areas[p.area], p.codec.encode(value));
        });
        transmitted_invalid_.fetch_add(invalid, std::memory_order_relaxed);
        return invalid != 0;
    }

private:
    struct Place {
        std::size_t area;
        std::size_t at;
        PinCodec codec;
        double scale = 1.0;
        double offset = 0.0;

        /// Returns the size of an entry that fills 16 or 32 bits at a byte boundary, as most do;
        /// 0: another one.
        unsigned plain_bits() const noexcept {
            const unsigned bits = codec.bits();
            return at % 8 == 0 && (bits == 16 || bits == 32) ? bits : 0U;
        }
        std::uint64_t read(std::span<const std::uint8_t> data) const noexcept {
            switch (plain_bits()) {
            case 16: return get<std::uint16_t>(&data[at / 8]);
            case 32: return get<std::uint32_t>(&data[at / 8]);
            default: return read_bits(data, at, codec.bits());
            }
        }
        void write(std::span<std::uint8_t> data, std::uint64_t value) const noexcept {
            switch (plain_bits()) {
            case 16: return put(&data[at / 8], static_cast<std::uint16_t>(value));
            case 32: return put(&data[at / 8], static_cast<std::uint32_t>(value));
            default: return write_bits(data, at, codec.bits(), value);
            }
        }
    };

    /// Returns true for a real type that fills the entry: only then the cycle reads and writes the
    /// bits of a real.
    static bool is_real(const master::Entry& e) noexcept {
        return (e.type == master::Type::real32 && e.bits == 32) ||
               (e.type == master::Type::real64 && e.bits == 64);
    }
    static bool is_signed(const master::Entry& e) noexcept {
        return e.is_signed || e.type == master::Type::s8 || e.type == master::Type::s16 ||
               e.type == master::Type::s32 || e.type == master::Type::s64;
    }
    static PinCodec codec_of(const master::Entry& e) noexcept {
        using Format = PinCodec::Format;
        if (is_real(e)) return {Format::real, e.bits};
        return {is_signed(e) ? Format::signed_integer : Format::unsigned_integer, e.bits};
    }
    void add(const std::string& name, const master::Entry& e, hal_type type, bool output,
             const Place& place) {
        char about[96];
        std::snprintf(about, sizeof about, "object 0x%04X:%u, %u bits%s", e.index, e.sub, e.bits,
                      e.copied ? ", copied from another slave: what was sent" : "");
        if (output) {
            ins_.declare(component_, &transmit_, type, name, about, place);
        } else {
            outs_.declare(component_, &receive_, type, name, about, place);
        }
    }

    Component& component_;
    const Function &receive_, &transmit_;
    AnyIns<Place> ins_;
    AnyOuts<Place> outs_;
    std::unique_ptr<Out<std::uint32_t>> invalid_;  // if there are real values
    // counted by take(), added to the pin by show()
    std::atomic<std::uint32_t> transmitted_invalid_{0};
};

}  // namespace hal::ethercat
