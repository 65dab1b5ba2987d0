// SPDX-License-Identifier: MIT
#include "run/stop_rule.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <string_view>

#include "text/numbers.hpp"

namespace hal::tools {
namespace {

double real_of(hal_type type, hal_value value) {
    switch (type) {
    case HAL_TYPE_BIT: return value.bit ? 1.0 : 0.0;
    case HAL_TYPE_S32: return value.s32;
    case HAL_TYPE_U32: return value.u32;
    case HAL_TYPE_S64: return static_cast<double>(value.s64);
    case HAL_TYPE_U64: return static_cast<double>(value.u64);
    default: return value.real;
    }
}

}  // namespace

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
    const double value = real_of(reading->type, reading->value);
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
    time_ns_ = parse_duration_ns(text);
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
