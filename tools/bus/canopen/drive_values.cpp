// SPDX-License-Identifier: MIT
#include "bus/canopen/drive_values.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>

#include "cia402/error_words.hpp"
#include "cli/output.hpp"
#include "text/diagnostic.hpp"
#include "text/find_row.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

using namespace cia402;

namespace {

/// A parameter; in user units if it has a `unit`.
struct Setting {
    enum class Unit { none, position, velocity, acceleration };
    const char* name;
    std::uint16_t index;
    std::uint8_t sub;
    unsigned bytes;
    bool is_signed;
    Unit unit;
    const char* what;
};
using enum Setting::Unit;
constexpr Setting drive_settings[] = {
    {"max-speed", object::profile_velocity, 0, 4, false, velocity, "profile velocity (6081h)"},
    {"max-acceleration", object::profile_acceleration, 0, 4, false, acceleration,
     "profile acceleration (6083h)"},
    {"max-deceleration", object::profile_deceleration, 0, 4, false, acceleration,
     "profile deceleration (6084h)"},
    {"jerk", object::profile_jerk, 1, 4, false, acceleration,
     "profile jerk, per second, with ramps 3 (60A4h:1)"},
    {"ramps", object::motion_profile_type, 0, 2, true, none,
     "motion profile: 0 linear, 3 with limited jerk (6086h)"},
    {"quick-stop-deceleration", object::quick_stop_deceleration, 0, 4, false, acceleration,
     "quick stop deceleration (6085h)"},
    {"max-torque", object::max_torque, 0, 2, false, none,
     "maximum torque in thousandths of the rated torque (6072h)"},
    {"following-error-window", object::following_error_window, 0, 4, false, position,
     "following error window (6065h)"},
    {"home-offset", object::home_offset, 0, 4, true, position,
     "position at the home switch (607Ch)"},
    {"home-speed", object::homing_speeds, 1, 4, false, velocity, "speed to the switch (6099h:1)"},
    {"home-slow-speed", object::homing_speeds, 2, 4, false, velocity,
     "speed to the index pulse or edge (6099h:2)"},
    {"home-acceleration", object::homing_acceleration, 0, 4, false, acceleration,
     "homing acceleration (609Ah)"},
};
constexpr const char* factors[] = {"position-factor", "velocity-factor", "acceleration-factor"};

const Setting* find_setting(const std::string& name) {
    return find_row(drive_settings, name, &Setting::name);
}

double factor_of(const SdoAxis& a, Setting::Unit unit) {
    if (unit == position) return a.rules.position.ratio();
    if (unit == velocity) return std::fabs(a.rules.velocity.ratio());
    if (unit == acceleration) return std::fabs(a.rules.acceleration.ratio());
    return 1.0;
}

Factor* find_factor(SdoAxis& a, const std::string& name) {
    Factor* const all[] = {&a.rules.position, &a.rules.velocity, &a.rules.acceleration};
    const auto* found = std::find(std::begin(factors), std::end(factors), name);
    return found == std::end(factors) ? nullptr : all[found - std::begin(factors)];
}

/// Parses `4096/360`, `4096,360`, `4096`.
bool parse_factor(const std::string& text, Factor& factor) {
    const auto mark = text.find_first_of("/,");
    Factor read;
    if (!parse_real(text.substr(0, mark), read.numerator)) return false;
    if (mark != text.npos && !parse_real(text.substr(mark + 1), read.denominator)) return false;
    if (!read.sound()) return false;
    factor = read;
    return true;
}

/// A value that the drive reports about itself.
struct Report {
    const char* name;
    std::string (*text)(const SdoAxis&);
};
constexpr Report reports[] = {
    {"position", [](const SdoAxis& a) { return fmt::format("{:.10g}", a.position()); }},
    {"speed", [](const SdoAxis& a) { return fmt::format("{:.10g}", a.velocity()); }},
    {"torque",
     [](const SdoAxis& a) {
    return fmt::format("{:.10g}", a.rules.torque.to_user(a.seen().torque));
}},
    {"mode", [](const SdoAxis& a) { return std::string(abbreviation(a.seen().mode)); }},
    {"state",
     [](const SdoAxis& a) { return std::string(to_string(state_of(a.seen().statusword))); }},
};

const Report* find_report(const std::string& name) {
    return find_row(reports, name, &Report::name);
}

/// The values of an object of `bytes`, as numbers.
struct Range {
    double min, max;
};
Range range_of(unsigned bytes, bool is_signed) {
    const int bits = static_cast<int>(8 * bytes);
    if (!is_signed) return {0.0, std::ldexp(1.0, bits) - 1};
    const double max = std::ldexp(1.0, bits - 1) - 1;
    return {-max - 1, max};
}

}  // namespace

bool parse_real(const std::string& text, double& value) {
    return parse_whole(std::string_view(text).substr(text.starts_with('+') ? 1 : 0), value) &&
           std::isfinite(value);
}

std::vector<std::string> value_names(bool reading) {
    std::vector<std::string> names(std::begin(factors), std::end(factors));
    for (const Setting& s : drive_settings) {
        names.emplace_back(s.name);
    }
    if (reading) {
        for (const Report& report : reports) {
            names.emplace_back(report.name);
        }
    }
    return names;
}

std::string value_help() {
    std::string text;
    for (const Setting& s : drive_settings) {
        text += fmt::format("    {:36} {}\n", s.name, s.what);
    }
    for (const char* name : factors) {
        text += fmt::format("    {:36} drive units per user unit, NUMERATOR/DENOMINATOR\n", name);
    }
    return text;
}

bool DriveValues::unknown(const std::string& name, bool reading) const {
    const std::string hint = did_you_mean(name, value_names(reading));
    return session_.wrong(
        fmt::format("unknown parameter '{}'; {}", name, hint.empty() ? "type: help" : hint));
}

bool DriveValues::query(SdoAxis& a, const std::string& name) {
    if (const Factor* f = find_factor(a, name)) {
        return session_.print_line(
            fmt::format("{}: {} {:.10g}/{:.10g}", a.letter(), name, f->numerator, f->denominator));
    }
    if (find_setting(name)) {
        double value = 0;
        return fetch(a, name, value) &&
               session_.print_line(fmt::format("{}: {} {:.10g}", a.letter(), name, value));
    }
    const Report* const report = find_report(name);
    if (!report) return unknown(name, true);
    return a.look() &&
           session_.print_line(fmt::format("{}: {} {}", a.letter(), name, report->text(a)));
}

bool DriveValues::set(SdoAxis& a, const std::string& name, const std::string& text) {
    if (Factor* f = find_factor(a, name)) {
        if (!parse_factor(text, *f)) {
            return session_.wrong(
                fmt::format("invalid factor '{}'; write NUMERATOR/DENOMINATOR, such as 4096/360, "
                            "neither of them 0",
                            text));
        }
        if (session_.settings().one_shot) {
            return session_.without_effect(fmt::format("{} set {} {}", a.letter(), name, text));
        }
        return query(a, name);
    }
    double value = 0;
    double back = 0;
    if (!find_setting(name)) return unknown(name, false);
    if (!parse_real(text, value)) {
        return session_.wrong(
            fmt::format("invalid number '{}'; type: {} set {} NUMBER", text, a.letter(), name));
    }
    return store(a, name, value, back) &&
           session_.print_line(fmt::format("{}: {} {:.10g}", a.letter(), name, back));
}

bool DriveValues::fetch(SdoAxis& a, const std::string& name, double& value) {
    const Setting* s = find_setting(name);
    std::int64_t raw = 0;
    if (!s || !a.read(s->index, s->sub, raw, s->is_signed)) return false;
    value = static_cast<double>(raw) / factor_of(a, s->unit);
    return true;
}

bool DriveValues::store(SdoAxis& a, const std::string& name, double value, double& back) {
    const Setting* s = find_setting(name);
    if (!s) return false;
    const double raw = std::nearbyint(value * factor_of(a, s->unit));
    const auto [min, max] = range_of(s->bytes, s->is_signed);
    if (raw < min || raw > max) {
        return session_.wrong(
            fmt::format("{} {:.10g} is {:.10g} in drive units, out of the range {:.10g}..{:.10g}",
                        name, value, raw, min, max));
    }
    std::int64_t kept = 0;
    if (!a.write(s->index, s->sub, static_cast<std::int64_t>(raw), s->bytes)) return false;
    if (!a.read(s->index, s->sub, kept, s->is_signed)) return false;
    back = static_cast<double>(kept) / factor_of(a, s->unit);
    return static_cast<double>(kept) == raw ||
           a.refuse(fmt::format("drive accepted the write but keeps {} at {:.10g}", name, back));
}

bool DriveValues::status(SdoAxis& a) {
    if (!a.look()) return false;
    const AxisFeedback& seen = a.seen();
    const State state = state_of(seen.statusword);
    std::string text = fmt::format("{}: {}, mode {}, statusword 0x{:04X}", a.letter(),
                                   to_string(state), abbreviation(seen.mode), seen.statusword);
    constexpr std::pair<std::uint16_t, const char*> bits[] = {
        {status::voltage_enabled, "voltage enabled"},
        {status::warning, "warning"},
        {status::remote, "remote"},
        {status::target_reached, "target reached"},
        {status::internal_limit, "internal limit"}};
    for (const auto& [bit, name] : bits) {
        if ((seen.statusword & bit) != 0) {
            text += fmt::format(", {}", name);
        }
    }
    text += fmt::format("\n   position {:.10g}, speed {:.10g}, torque {:.10g}", a.position(),
                        a.velocity(), a.rules.torque.to_user(seen.torque));
    if (state == State::fault && seen.error_code != 0) {
        text +=
            fmt::format("\n   error 0x{:04X}: {}", seen.error_code, error_word(seen.error_code));
    }
    return session_.print_line(text);
}

}  // namespace hal::tools
