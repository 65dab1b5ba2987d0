// SPDX-License-Identifier: MIT
// A drive of CiA 402 as a program that a Node runs.
#pragma once

#include <memory>

#include "canopen/device/program.hpp"
#include "drive.hpp"

namespace hal::canopen {

class DriveProgram final : public Program {
public:
    explicit DriveProgram(const cia402::DriveSettings&);  // [setup]

    Description description() const override { return cia402::drive_description(settings_); }
    Device& make(const DeviceSettings&) override;
    void boot(Time now) noexcept override { drive_->start(now); }
    void step(Time now) noexcept override { drive_->step(now); }
    bool set(std::string_view name, double value) override;
    std::vector<std::string> settable() const override;
    std::string summary() const override;

    /// Returns the drive, once the Node exists. [realtime]
    cia402::Drive& drive() noexcept { return *drive_; }

private:
    cia402::DriveSettings settings_;
    std::unique_ptr<cia402::Drive> drive_;
};

/// Sets a motor parameter by name, as in "inertia" and 1e-4. Returns false for an unknown name.
/// [setup]
bool set_motor(cia402::MotorSettings&, std::string_view name, double value);
/// Parses "inertia:1e-4,resolution:8192"; empty is valid. Returns the problem, or "". [setup]
std::string parse_motor(std::string_view text, cia402::MotorSettings&);

}  // namespace hal::canopen
