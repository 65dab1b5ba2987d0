// SPDX-License-Identifier: MIT
// The argument `faults` of can_faults and segment_faults:
// "loss:every=50:from=1s,duplicate:count=3". Everything is [setup].
#pragma once

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "hal/component.hpp"
#include "text/numbers.hpp"

namespace hal::faults {

inline constexpr std::size_t max_faults = 32;

template <class Fault>
struct Named {
    const char* name;
    Fault fault;
};

[[noreturn]] inline void reject(std::string_view part, const std::string& reason) {
    throw hal::ArgumentError("faults", "invalid fault '" + std::string(part) + "': " + reason);
}

/// Returns the text up to a separator, and removes both from the front.
inline std::string_view cut(std::string_view& text, char separator) {
    const auto first = text.substr(0, text.find(separator));
    text.remove_prefix(std::min(first.size() + 1, text.size()));
    return first;
}

inline std::int64_t time(std::string_view part, std::string_view text) {
    const auto value = hal::parse_duration_ns(text, 0.0);
    if (!value || *value < 0) {
        reject(part, "'" + std::string(text) +
                         "' is not a time; write one with a unit, for example 20ms");
    }
    return *value;
}
inline std::uint64_t count(std::string_view part, std::string_view text,
                           std::uint64_t max = std::numeric_limits<std::uint64_t>::max()) {
    const auto value = hal::parse_natural(text);
    if (!value || *value > max) {
        reject(part, "'" + std::string(text) + "' is not a number" +
                         (value ? " up to " + std::to_string(max) : ""));
    }
    return *value;
}

/// Parses "word:key=value:…". The options every, probability, count, from, until and time are those
/// of both buses; `other` takes the rest and returns false for an unknown one.
template <class Disturbance, class Names, class Other>
Disturbance parse(std::string_view part, const Names& names, Disturbance d, const std::string& help,
                  Other other) {
    std::string_view rest = part;
    const auto word = cut(rest, ':');
    const auto found = std::find_if(std::begin(names), std::end(names),
                                    [&](const auto& n) { return word == n.name; });
    if (found == std::end(names)) {
        reject(part, help);
    }
    d.fault = found->fault;
    d.every = 1;
    while (!rest.empty()) {
        std::string_view value = cut(rest, ':');
        const auto key = cut(value, '=');
        if (key == "from") {
            d.from_ns = time(part, value);
        } else if (key == "until") {
            d.until_ns = time(part, value);
        } else if (key == "time") {
            d.delay_ns = time(part, value);
        } else if (key == "count") {
            d.count = count(part, value);
        } else if (key == "every") {
            d.every = static_cast<std::uint32_t>(count(part, value, 1'000'000'000));
        } else if (key == "probability") {
            const auto real = hal::parse_real(value);
            if (!real || *real < 0.0) {
                reject(part, "'" + std::string(value) + "' is not a number");
            }
            if (*real > 1.0) {
                reject(part, "probability exceeds 1");
            }
            d.probability = *real;
            d.every = 0;
        } else if (!other(d, key, value)) {
            reject(part, "unknown option '" + std::string(key) + "'; " + help);
        }
    }
    if (d.every == 0 && d.probability == 0.0) {
        reject(part, "every must be at least 1, or probability above 0");
    }
    return d;
}

/// Parses a comma-separated list with `parse_one(part)`.
template <class ParseOne>
auto parse_list(std::string_view text, ParseOne parse_one) {
    std::vector<decltype(parse_one(text))> all;
    while (!text.empty()) {
        all.push_back(parse_one(cut(text, ',')));
    }
    if (all.size() > max_faults) {
        throw hal::ArgumentError("faults", std::to_string(all.size()) + " faults (limit " +
                                               std::to_string(max_faults) + ")");
    }
    return all;
}

}  // namespace hal::faults
