// SPDX-License-Identifier: MIT
#include "drive_program.hpp"

#include <charconv>
#include <cmath>
#include <limits>

#include "cia402/error_words.hpp"

namespace hal::canopen {

namespace {

struct MotorRow {
    const char* name;
    double cia402::MotorSettings::* value;
    double least;
};
using Motor = cia402::MotorSettings;
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

/// The axis in "NAME-3".
bool axis_in(std::string_view text, std::string_view name, unsigned axes, unsigned& axis) {
    if (!text.starts_with(name)) return false;
    text.remove_prefix(name.size());
    if (text.size() != 2 || text[0] != '-' || text[1] < '0' || text[1] > '9') return false;
    axis = static_cast<unsigned>(text[1] - '0');
    return axis < axes;
}

}  // namespace

bool set_motor(cia402::MotorSettings& motor, std::string_view name, double value) {
    if (name == "resolution") {
        if (!(value >= 1 && value <= 16'777'216 && value == std::floor(value))) return false;
        motor.resolution = static_cast<std::uint32_t>(value);
        return true;
    }
    if (name == "endless") return value != 0.0 ? (void)motor.endless() : void(), true;
    for (const auto& row : motor_rows) {
        if (name == row.name) return value >= row.least && (motor.*row.value = value, true);
    }
    return false;
}

std::string parse_motor(std::string_view text, cia402::MotorSettings& motor) {
    while (!text.empty()) {
        const auto part = text.substr(0, text.find(','));
        text.remove_prefix(std::min(part.size() + 1, text.size()));
        const auto sign = part.find_first_of(":=");
        double value = 0;
        const auto digits = sign == part.npos ? std::string_view{} : part.substr(sign + 1);
        const auto [end, wrong] =
            std::from_chars(digits.data(), digits.data() + digits.size(), value);
        const bool number =
            wrong == std::errc{} && !digits.empty() && end == digits.data() + digits.size();
        if (number && set_motor(motor, part.substr(0, sign), value)) continue;
        std::string names = "resolution, endless";
        for (const auto& row : motor_rows) {
            names += std::string(", ") + row.name;
        }
        return "invalid motor parameter '" + std::string(part) +
               "'; write NAME:VALUE, as in inertia:1e-4; names: " + names;
    }
    return {};
}

DriveProgram::DriveProgram(const cia402::DriveSettings& settings) : settings_(settings) {
    if (settings_.vendor == 0) {
        settings_.vendor = example_vendor;
    }
}

Device& DriveProgram::make(const DeviceSettings& settings) {
    drive_ = std::make_unique<cia402::Drive>(settings_, settings, this);
    return drive_->device();
}

bool DriveProgram::set(std::string_view name, double value) {
    unsigned axis = 0;
    if (axis_in(name, "load-torque", settings_.axes, axis)) {
        drive_->set_load_torque(axis, value);
        return true;
    }
    if (axis_in(name, "dc-link", settings_.axes, axis)) {
        drive_->set_dc_link(axis, value);
        return true;
    }
    if (axis_in(name, "inputs", settings_.axes, axis)) {
        drive_->set_inputs(
            axis, value >= 0 && value < 4294967296.0 ? static_cast<std::uint32_t>(value) : 0);

        return true;
    }
    if (axis_in(name, "encoder-broken", settings_.axes, axis)) {
        drive_->set_encoder_broken(axis, value != 0.0);
        return true;
    }
    return false;
}

std::vector<std::string> DriveProgram::settable() const {
    std::vector<std::string> names;
    for (const char* name : {"load-torque-", "dc-link-", "inputs-", "encoder-broken-"}) {
        for (unsigned n = 0; n < settings_.axes; ++n) {
            names.push_back(name + std::to_string(n));
        }
    }
    return names;
}

std::string DriveProgram::summary() const {
    std::string text;
    for (unsigned n = 0; n < settings_.axes; ++n) {
        const auto s = drive_->status(n);
        text += (n == 0 ? "" : "; ") +
                (settings_.axes == 1 ? std::string() : "axis " + std::to_string(n) + " ") +
                cia402::to_string(s.state);
        if (s.mode != cia402::Mode::none) {
            text += std::string(", ") + cia402::to_string(s.mode);
        }
        if (s.error_code != 0) {
            text += std::string(", error ") + cia402::error_word(s.error_code);
        }
    }
    return text;
}

}  // namespace hal::canopen
