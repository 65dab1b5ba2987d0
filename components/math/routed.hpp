// SPDX-License-Identifier: MIT
// mux_generic and demux_generic: any number of ways, any type in, any type out.
#pragma once

#include "conv.hpp"
#include "hal/naming.hpp"

namespace routed {

/// What `fu12` says: float in, u32 out, 12 ways. The number may stand anywhere between the letters.
struct Config {
    char from = 0, to = 0;
    std::int64_t ways = 0;

    explicit Config(const std::string& text) {
        const auto refuse = [&](const char* why) { throw hal::ArgumentError("config", "config=" + text + " " + why); };
        std::string digits;
        for (const char c : text) {
            if (c >= '0' && c <= '9') digits += c;
            else if (const char letter = static_cast<char>(c | 0x20); letter != 'b' && letter != 'f' && letter != 's' && letter != 'u')
                refuse("has a letter that is no type: b bit, f float, s s32, u u32; write it like fu12");
            else if (from == 0) from = letter;
            else if (to == 0) to = letter;
            else refuse("names more than two types; write it like fu12");
        }
        if (to == 0) refuse("names no two types; write the type in, the type out and the number of ways, like fu12");
        ways = digits.empty() || digits.size() > 4 ? 0 : std::stol(digits);
        if (ways < 1 || ways > 1024) refuse("has no number of ways from 1 to 1024");
    }
    /// The selection bits: as many as the ways need when these are a power of two, otherwise none.
    std::int64_t select_bits() const noexcept {
        std::int64_t bits = 0;
        while ((std::int64_t{1} << bits) < ways) ++bits;
        return (std::int64_t{1} << bits) == ways ? bits : 0;
    }
};

/// The pin a component has of the one type it was configured for: one of four rows, the others empty.
template <template <class> class Row>
class AnyType {
public:
    AnyType(hal::Component& component, char type, const char* before, const char* after, std::int64_t count, const char* doc)
        : bit_(component, name(before, "bit", after).c_str(), type == 'b' ? count : 0, doc),
          real_(component, name(before, "float", after).c_str(), type == 'f' ? count : 0, doc),
          s32_(component, name(before, "s32", after).c_str(), type == 's' ? count : 0, doc),
          u32_(component, name(before, "u32", after).c_str(), type == 'u' ? count : 0, doc) {}

    /// Calls `action` with the row that has pins. [realtime]
    template <class Action>
    void visit(Action action) noexcept {
        if (bit_.size() != 0) action(bit_);
        else if (real_.size() != 0) action(real_);
        else if (s32_.size() != 0) action(s32_);
        else action(u32_);
    }

private:
    static std::string name(const char* before, const char* type, const char* after) { return std::string(before) + type + after; }
    Row<bool> bit_;
    Row<double> real_;
    Row<std::int32_t> s32_;
    Row<std::uint32_t> u32_;
};

/// `value` in the other type: cut, and limited to its range. A float within 2e-7 of 0 is FALSE. [any]
template <class To, class From>
To converted(From value) noexcept {
    if constexpr (std::same_as<To, bool> && std::same_as<From, double>) return std::fabs(value) > 2e-7;
    else if constexpr (std::same_as<To, bool>) return value != From{0};
    else return conv::convert<To>(value, true);
}

/// Copies a pin into another of any type. [realtime]
template <class In, class Out>
void copy(const In& from, Out& to) noexcept {
    using To = std::remove_cvref_t<decltype(to.get())>;
    to = converted<To>(from.get());
}

/// The choice both components make, with debouncing.
class Choice {
public:
    Choice(hal::Component& component, const Config& config)
        : ways(static_cast<std::uint64_t>(config.ways)),
          keep{component, "suppress-no-input", "TRUE: a choice of 0 changes nothing; way 00 cannot be chosen"},
          debounce_us{component, "debounce-us", "how long a choice must hold before it counts", {.unit = "us"}},
          bit{component, "sel-bit-##", config.select_bits(), "bit # of the choice"},
          number{component, "sel-int", "added to the number made of the bits"},
          elapsed{component, "elapsed", "how long the choice has held", {.unit = "us"}},
          selected{component, "selected", "the choice that counts"} {}

    /// The way that counts now, the last one for a choice beyond it; none (the number of ways) at first and while a
    /// choice of 0 is suppressed. [realtime]
    std::uint64_t update(const hal::Cycle& cycle) noexcept {
        std::uint64_t wanted = number;
        for (std::size_t i = 0; i < bit.size(); ++i) wanted += bit[i] ? std::uint64_t{1} << i : 0;
        held_ns_ = wanted == wanted_ ? held_ns_ + (held_ns_ < (std::int64_t{1} << 62) ? cycle.period_ns() : 0) : 0;
        wanted_ = wanted;
        elapsed = static_cast<std::uint32_t>(std::min<std::int64_t>(held_ns_ / 1000, UINT32_MAX));
        if (keep && wanted == 0) return ways;
        if (held_ns_ >= std::int64_t{debounce_us} * 1000) {
            chosen_ = std::min(wanted, ways - 1);
            any_ = true;
            selected = static_cast<std::uint32_t>(chosen_);
        }
        return any_ ? chosen_ : ways;
    }

    const std::uint64_t ways;

private:
    hal::In<bool> keep;
    hal::In<std::uint32_t> debounce_us;
    hal::Ins<bool> bit;
    hal::In<std::uint32_t> number;
    hal::Out<std::uint32_t> elapsed, selected;
    std::uint64_t wanted_ = 0, chosen_ = 0;
    std::int64_t held_ns_ = 0;
    bool any_ = false;
};

}  // namespace routed
