// SPDX-License-Identifier: MIT
#include "cia402/drive/motor_options.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>

namespace hal::cia402 {

namespace {

struct MotorRow {
    const char* name;
    double MotorSettings::* value;
    double min;
};
using Motor = MotorSettings;
constexpr double anything = -std::numeric_limits<double>::max();
constexpr MotorRow motor_rows[] = {
    {"inertia", &Motor::inertia, 1e-9},
    {"viscous-friction", &Motor::viscous_friction, 0},
    {"coulomb-friction", &Motor::coulomb_friction, 0},
    {"rated-torque", &Motor::rated_torque, 1e-6},
    {"peak-torque", &Motor::peak_torque, 1e-6},
    {"rated-current", &Motor::rated_current, 1e-6},
    {"rated-voltage", &Motor::rated_voltage, 1e-3},
    {"highest-speed", &Motor::highest_speed, 1e-3},
    {"start", &Motor::start, anything},
    {"negative-limit", &Motor::negative_limit, anything},
    {"positive-limit", &Motor::positive_limit, anything},
    {"negative-stop", &Motor::negative_stop, anything},
    {"positive-stop", &Motor::positive_stop, anything},
    {"home-from", &Motor::home_from, anything},
    {"home-to", &Motor::home_to, anything},
    {"brake-torque", &Motor::brake_torque, 0},
};

std::string names_of_parameters() {
    std::string names = "resolution, endless";
    for (const auto& row : motor_rows) {
        names += std::string(", ") + row.name;
    }
    return names;
}

std::optional<double> number_of(std::string_view text) {
    double value = 0;
    const char* end = text.data() + text.size();
    const auto result = std::from_chars(text.data(), end, value);
    if (text.empty() || result.ec != std::errc{} || result.ptr != end) return std::nullopt;
    return value;
}

}  // namespace

bool set_motor(MotorSettings& motor, std::string_view name, double value) {
    if (name == "resolution") {
        if (!(value >= 1 && value <= 16'777'216 && value == std::floor(value))) return false;
        motor.resolution = static_cast<std::uint32_t>(value);
        return true;
    }
    if (name == "endless") {
        if (value != 0.0) {
            motor.endless();
        }
        return true;
    }
    for (const auto& row : motor_rows) {
        if (name != row.name) continue;
        if (!(value >= row.min)) return false;
        motor.*row.value = value;
        return true;
    }
    return false;
}

std::string parse_motor(std::string_view text, MotorSettings& motor) {
    while (!text.empty()) {
        const auto part = text.substr(0, text.find_first_of(",;"));
        text.remove_prefix(std::min(part.size() + 1, text.size()));
        const auto sign = part.find_first_of(":=");
        const auto value = sign == part.npos ? std::nullopt : number_of(part.substr(sign + 1));
        if (value && set_motor(motor, part.substr(0, sign), *value)) continue;
        return "invalid motor parameter '" + std::string(part) +
               "'; write NAME:VALUE, as in inertia:1e-4; names: " + names_of_parameters();
    }
    return {};
}

}  // namespace hal::cia402
