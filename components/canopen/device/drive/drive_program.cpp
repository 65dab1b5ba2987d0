// SPDX-License-Identifier: MIT
#include "drive_program.hpp"

#include "cia402/error_words.hpp"

namespace hal::canopen {

namespace {

/// The axis in "NAME-3".
bool axis_in(std::string_view text, std::string_view name, unsigned axes, unsigned& axis) {
    if (!text.starts_with(name)) return false;
    text.remove_prefix(name.size());
    if (text.size() != 2 || text[0] != '-' || text[1] < '0' || text[1] > '9') return false;
    axis = static_cast<unsigned>(text[1] - '0');
    return axis < axes;
}

}  // namespace

DriveProgram::DriveProgram(const DriveSettings& settings) : settings_(settings) {
    if (settings_.vendor == 0) {
        settings_.vendor = example_vendor;
    }
}

Device& DriveProgram::make(const DeviceSettings& settings) {
    drive_ = std::make_unique<Drive>(settings_, settings, this);
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
