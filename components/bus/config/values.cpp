// SPDX-License-Identifier: MIT
#include "bus/config/values.hpp"

#include <algorithm>
#include <cmath>

#include "text/characters.hpp"

namespace hal::bus {

namespace {

struct Unit {
    const char* name;
    double scale;
};
constexpr Unit rate_units[] = {{"k", 1e3}, {"M", 1e6}, {"", 1}};

std::string rate_text(double rate) {
    for (const Unit& unit : {rate_units[1], rate_units[0]}) {
        const double number = rate / unit.scale;
        if (number >= 1 && number == std::floor(number)) {
            return std::to_string(static_cast<std::int64_t>(number)) + unit.name;
        }
    }
    return std::to_string(static_cast<std::int64_t>(rate));
}

}  // namespace

std::string time_text(std::int64_t ns) {
    struct TimeUnit {
        const char* name;
        std::int64_t ns;
    };
    if (ns == 0) return "0";
    for (const TimeUnit& unit :
         {TimeUnit{"s", 1'000'000'000}, TimeUnit{"ms", 1'000'000}, TimeUnit{"us", 1'000}}) {
        if (ns % unit.ns == 0) return std::to_string(ns / unit.ns) + unit.name;
    }
    return std::to_string(ns) + "ns";
}

std::optional<std::int64_t> parse_time(std::string_view text, double bare_unit_ns) {
    const bool negative = text.starts_with('-');
    const auto value = parse_duration_ns(negative ? text.substr(1) : text, bare_unit_ns);
    if (!value) return std::nullopt;
    return negative ? -*value : *value;
}

std::optional<std::uint32_t> parse_bit_rate(std::string_view text, double min, double max) {
    const auto value = parse_quantity(text);
    if (!value) return std::nullopt;
    const auto* unit = std::find_if(std::begin(rate_units), std::end(rate_units),
                                    [&](const Unit& one) { return value->unit == one.name; });
    if (unit == std::end(rate_units)) return std::nullopt;
    const double rate = value->number * unit->scale;
    if (!(rate >= min && rate <= max)) return std::nullopt;
    return static_cast<std::uint32_t>(std::lround(rate));
}

std::optional<bool> parse_flag(std::string_view text) {
    for (const char* word : {"yes", "true", "on", "1"}) {
        if (same_word(text, word)) return true;
    }
    for (const char* word : {"no", "false", "off", "0"}) {
        if (same_word(text, word)) return false;
    }
    return std::nullopt;
}

bool is_name(std::string_view text, std::string_view more) {
    constexpr std::size_t max_length = 40;
    const auto fits = [&](char c) {
        return is_alphanumeric(c) || c == '-' || c == '_' || more.find(c) != more.npos;
    };
    return text.size() <= max_length && std::all_of(text.begin(), text.end(), fits);
}

ValueForm time_form(std::int64_t min, std::int64_t max, bool none, bool bare) {
    const std::string range = time_text(min) + ".." + time_text(max);
    std::string expected = std::string(none ? "none, or " : "") + "a time of " + range;
    expected += bare ? ", in microseconds or with a unit" : ", as in 10ms or 0.5s";
    return {expected, (none ? "none, " : "") + range, "TIME"};
}

ValueForm number_form(std::uint64_t min, std::uint64_t max) {
    const std::string range = std::to_string(min) + ".." + std::to_string(max);
    return {"a number of " + range + ", decimal or with 0x", range, "NUMBER"};
}

ValueForm flag_form() { return {"yes or no", "yes, no", "yes|no"}; }

ValueForm choice_form(const std::vector<std::string>& words) {
    std::string expected;
    std::string range;
    for (std::size_t i = 0; i < words.size(); ++i) {
        const char* separator = i + 1 == words.size() ? " or " : ", ";
        expected += (i == 0 ? "" : separator) + words[i];
        range += (i == 0 ? "" : ", ") + words[i];
    }
    return {expected, range, "WORD"};
}

ValueForm rate_form(double min, double max) {
    const std::string range = rate_text(min) + ".." + rate_text(max);
    return {"a bit rate of " + range + ", as in 1M, 500k or 125000", range, "RATE"};
}

}  // namespace hal::bus
