// SPDX-License-Identifier: MIT
// mux_generic and demux_generic: any number of channels, any type in, any type out.
#pragma once

#include "conv.hpp"
#include "hal/naming.hpp"

namespace routed {

/// Parses `fu12`: float in, u32 out, 12 channels. The number may be anywhere between the letters.
struct Config {
    char from = 0;
    char to = 0;
    std::int64_t ways = 0;

    explicit Config(const std::string& text) {
        const auto refuse = [&](const char* why) {
            throw hal::ArgumentError("config", "config=" + text + " " + why);
        };
        std::string digits;
        for (const char c : text) {
            if (c >= '0' && c <= '9') {
                digits += c;
            } else if (const char letter = static_cast<char>(c | 0x20);
                       letter != 'b' && letter != 'f' && letter != 's' && letter != 'u') {
                refuse(
                    "has an invalid type letter; use b (bit), f (float), s (s32) or u (u32), as in "
                    "fu12");
            } else if (from == 0) {
                from = letter;
            } else if (to == 0) {
                to = letter;
            } else {
                refuse(
                    "has more than two types; write the type in, the type out and the number of "
                    "channels, as in fu12");
            }
        }
        if (to == 0) {
            refuse(
                "has fewer than two types; write the type in, the type out and the number of "
                "channels, as in fu12");
        }
        ways = digits.empty() || digits.size() > 4 ? 0 : std::stol(digits);
        if (ways < 1 || ways > 1024) {
            refuse("has no number of channels in 1..1024; write it as in fu12");
        }
    }
    /// Returns the number of selection bits: log2 of the channels if these are a power of two or
    /// one more, as in LinuxCNC; else 0.
    std::int64_t select_bits() const noexcept {
        std::int64_t bits = 0;
        while ((std::int64_t{2} << bits) <= ways) {
            ++bits;
        }
        const std::int64_t beyond = ways - (std::int64_t{1} << bits);
        return beyond <= 1 ? bits : 0;
    }
};

/// The pins of the configured type: one of four arrays, the others are empty.
template <template <class> class Row>
class AnyType {
public:
    AnyType(hal::Component& component, char type, const char* before, const char* after,
            std::int64_t count, const char* doc)
        : bit_(component, name(before, "bit", after).c_str(), type == 'b' ? count : 0, doc),
          real_(component, name(before, "float", after).c_str(), type == 'f' ? count : 0, doc),
          s32_(component, name(before, "s32", after).c_str(), type == 's' ? count : 0, doc),
          u32_(component, name(before, "u32", after).c_str(), type == 'u' ? count : 0, doc) {}

    /// Calls `action` with the array that has pins. [realtime]
    template <class Action>
    void visit(Action action) noexcept {
        if (bit_.size() != 0) {
            action(bit_);
        } else if (real_.size() != 0) {
            action(real_);
        } else if (s32_.size() != 0) {
            action(s32_);
        } else {
            action(u32_);
        }
    }

private:
    static std::string name(const char* before, const char* type, const char* after) {
        return std::string(before) + type + after;
    }
    Row<bool> bit_;
    Row<double> real_;
    Row<std::int32_t> s32_;
    Row<std::uint32_t> u32_;
};

/// Converts `value`, truncated and limited to the range of the other type. A float within 2e-7 of 0
/// is FALSE. [any]
template <class To, class From>
To converted(From value) noexcept {
    if constexpr (std::same_as<To, bool> && std::same_as<From, double>) {
        return std::fabs(value) > 2e-7;
    } else if constexpr (std::same_as<To, bool>) {
        return value != From{0};
    } else {
        return conv::convert<To>(value, true);
    }
}

/// Copies a pin into another of any type. [realtime]
template <class In, class Out>
void copy(const In& from, Out& to) noexcept {
    using To = std::remove_cvref_t<decltype(to.get())>;
    to = converted<To>(from.get());
}

/// The debounced selection of both components.
class Choice {
public:
    Choice(hal::Component& component, const Config& config)
        : ways(static_cast<std::uint64_t>(config.ways)),
          keep{component, "suppress-no-input",
               "TRUE ignores the selection 0; channel 00 cannot be selected"},
          debounce_us{component,
                      "debounce-us",
                      "time from a new selection until it is in use",
                      {.unit = "us"}},
          bit{component, "sel-bit-##", config.select_bits(), "bit # of the selection"},
          number{component, "sel-int", "number added to that of the sel-bit pins"},
          elapsed{component,
                  "elapsed",
                  "time since the selection differs from selected",
                  {.unit = "us"}},
          selected{component, "selected", "selection in use"} {}

    /// Returns the selected channel, the last one for a selection above it; the number of channels
    /// if the outputs are held: while a new selection is debounced, and while the selection 0 is
    /// suppressed. [realtime]
    std::uint64_t update(const hal::Cycle& cycle) noexcept {
        std::uint64_t sum = number;
        for (std::size_t i = 0; i < bit.size(); ++i) {
            sum += bit[i] ? std::uint64_t{1} << i : 0;
        }
        constexpr std::uint64_t max_selection = std::numeric_limits<std::uint32_t>::max();
        const auto wanted = static_cast<std::uint32_t>(std::min(sum, max_selection));
        if (keep && wanted == 0) return ways;
        if (wanted != selected && elapsed < debounce_us) {
            elapsed = elapsed + static_cast<std::uint32_t>(cycle.period_ns() / 1000);
            return ways;
        }
        selected = wanted;
        elapsed = 0;
        return std::min<std::uint64_t>(wanted, ways - 1);
    }

    const std::uint64_t ways;

private:
    hal::In<bool> keep;
    hal::In<std::uint32_t> debounce_us;
    hal::Ins<bool> bit;
    hal::In<std::uint32_t> number;
    hal::Out<std::uint32_t> elapsed, selected;
};

}  // namespace routed
