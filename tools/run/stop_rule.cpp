// SPDX-License-Identifier: MIT
#include "run/stop_rule.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdlib>
#include <string_view>

#include "run/real_value.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

bool ValueCondition::parse(const std::string& text) {
    const std::size_t at = text.find_first_of("<>=!");
    if (at == std::string::npos || at == 0) return false;
    const std::size_t value = text.find_first_not_of("<>=!", at);
    if (value == std::string::npos) return false;
    name_ = text.substr(0, text.find_last_not_of(' ', at - 1) + 1);
    operator_ = text.substr(at, value - at);
    char* end = nullptr;
    value_ = std::strtod(text.c_str() + value, &end);
    constexpr std::string_view known[] = {">", "<", ">=", "<=", "==", "!="};
    const bool good = !name_.empty() && *end == '\0' && end != text.c_str() + value &&
                      std::ranges::find(known, operator_) != std::end(known);
    if (!good) {
        name_.clear();
    }
    return good;
}

bool ValueCondition::holds(Session& session) const {
    const auto reading = session.values().read({name_}).front();
    if (!reading) return false;
    const double value = real_value(reading->type, reading->value);
    if (operator_ == ">") return value > value_;
    if (operator_ == "<") return value < value_;
    if (operator_ == ">=") return value >= value_;
    if (operator_ == "<=") return value <= value_;
    if (operator_ == "==") return value == value_;
    return value != value_;
}

bool ValueCondition::is_unknown(const Session& session) const {
    return !name_.empty() && !session.model().find_pin(name_) &&
           !session.model().find_signal(name_);
}

bool JournalPosition::parse(const std::string& text) {
    std::uint64_t cycle = 0;
    const char* const end = text.data() + text.size();
    const auto [rest, error] = std::from_chars(text.data(), end, cycle);
    if (error == std::errc() && rest == end) {
        cycle_ = cycle;
        return true;
    }
    // a number without a unit would be a time if it is not whole: 1e3 must not mean 1000 s
    const bool has_unit = !text.empty() && std::isalpha(static_cast<unsigned char>(text.back()));
    time_ns_ = has_unit ? parse_duration_ns(text) : std::nullopt;
    return time_ns_.has_value();
}

bool JournalPosition::reached(const JournaledCycle& newest, const std::string& fastest) const {
    if (cycle_) return newest.thread == fastest && newest.number >= *cycle_;
    return time_ns_ && newest.time_ns >= *time_ns_;
}

bool JournalPosition::reached(std::uint64_t fastest_cycle, std::int64_t time_ns) const {
    return cycle_ ? fastest_cycle >= *cycle_ : time_ns_ && time_ns >= *time_ns_;
}

}  // namespace hal::tools
