// SPDX-License-Identifier: MIT
// A drive of CiA 402 as a program that a Node runs.
#pragma once

#include <memory>

#include "canopen/device/program.hpp"
#include "cia402/drive/motor_options.hpp"
#include "drive.hpp"

namespace hal::canopen {

class DriveProgram final : public Program {
public:
    explicit DriveProgram(const DriveSettings&);  // [setup]

    Description description() const override { return drive_description(settings_); }
    Device& make(const DeviceSettings&) override;
    void boot(Time now) noexcept override { drive_->start(now); }
    void step(Time now) noexcept override { drive_->step(now); }
    void lose_power() noexcept override { drive_->lose_power(); }
    void rest(Time now) noexcept override { drive_->rest(now); }
    bool set(std::string_view name, double value) override;
    std::vector<std::string> settable() const override;
    std::string summary() const override;

    /// Returns the drive, once the Node exists. [realtime]
    Drive& drive() noexcept { return *drive_; }

private:
    DriveSettings settings_;
    std::unique_ptr<Drive> drive_;
};

using cia402::parse_motor;

}  // namespace hal::canopen
