// SPDX-License-Identifier: MIT
#include "slave_fault.hpp"

#include <algorithm>

#include "modbus/wire/frame.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::modbus {

namespace {

bool parse_unit(std::string_view text, SlaveFault& fault) {
    return parse_whole(text, fault.unit) && fault.unit <= max_unit;
}
bool parse_every(std::string_view text, SlaveFault& fault) {
    return parse_whole(text, fault.every) && fault.every > 0;
}
bool parse_share(std::string_view text, SlaveFault& fault) {
    return parse_whole(text, fault.share) && fault.share >= 0.0 && fault.share <= 1.0;
}
template <std::int64_t SlaveFault::* member>
bool parse_time(std::string_view text, SlaveFault& fault) {
    const auto time = parse_duration_ns(text);
    if (!time || *time < 0) return false;
    fault.*member = *time;
    return true;
}

constexpr bool is_of_all(FaultKind) { return true; }
constexpr bool is_of_answers(FaultKind kind) { return kind != FaultKind::noise; }
constexpr bool is_of_late(FaultKind kind) { return kind == FaultKind::late; }
constexpr bool is_of_noise(FaultKind kind) { return kind == FaultKind::noise; }

struct Option {
    std::string_view name;
    bool (*is_of)(FaultKind);
    bool (*parse)(std::string_view, SlaveFault&);
    std::string_view values;
};
constexpr Option options[] = {
    {"unit", is_of_answers, parse_unit, "a slave, 1..247, or 0 for all"},
    {"every", is_of_answers, parse_every, "a whole number from 1"},
    {"late", is_of_late, parse_time<&SlaveFault::late_ns>, "a time, as in late=200ms"},
    {"share", is_of_noise, parse_share, "a number in 0..1"},
    {"from", is_of_all, parse_time<&SlaveFault::from_ns>, "a time, as in from=1s"},
    {"for", is_of_all, parse_time<&SlaveFault::until_ns>, "a time, as in for=2s"},
};

std::string parse_option(std::string_view text, SlaveFault& fault) {
    const auto equals = std::min(text.find('='), text.size());
    const std::string_view name = text.substr(0, equals);
    const auto* const option = std::ranges::find_if(
        options, [&](const Option& one) { return one.name == name && one.is_of(fault.kind); });
    if (option == std::end(options)) {
        std::string names;
        for (const Option& one : options) {
            if (one.is_of(fault.kind)) {
                append_item(names, one.name);
            }
        }
        return std::string(fault_names[static_cast<std::size_t>(fault.kind)]) + " has no option " +
               quoted(name) + "; its options are " + names;
    }
    const std::string_view value = text.substr(std::min(equals + 1, text.size()));
    if (option->parse(value, fault)) return {};
    return "invalid option " + quoted(text) + "; write " + std::string(option->values);
}

}  // namespace

std::string parse_fault(std::string_view text, SlaveFault& fault) {
    const std::string_view name = text.substr(0, text.find(':'));
    const auto* const found = std::ranges::find(fault_names, name);
    if (found == std::end(fault_names)) {
        std::string names;
        for (const char* one : fault_names) {
            append_item(names, one);
        }
        return "unknown fault " + quoted(name) + "; faults are " + names;
    }
    fault.kind = static_cast<FaultKind>(found - std::begin(fault_names));
    for (std::string_view rest = text.substr(name.size()); !rest.empty();) {
        rest.remove_prefix(1);
        const std::string_view option = rest.substr(0, rest.find(':'));
        rest.remove_prefix(option.size());
        if (std::string problem = parse_option(option, fault); !problem.empty()) return problem;
    }
    if (fault.until_ns != INT64_MAX) {
        fault.until_ns += fault.from_ns;
    }
    return {};
}

}  // namespace hal::modbus
