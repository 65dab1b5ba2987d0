// SPDX-License-Identifier: MIT
// What an axis watches in every step: following error, standstill, slippage, and its inputs.
#pragma once

#include "cia402/drive/motion_modes.hpp"

namespace hal::cia402 {

/// The monitor. [realtime]
class AxisMonitor {
public:
    /// Both must outlive it. [setup]
    AxisMonitor(const Drivetrain& train, const AxisValues& values) noexcept
        : train_(train), values_(values) {}

    void power_up() noexcept { result_ = {}; }
    /// Restarts the time of the following error.
    void restart() noexcept { following_time_ = 0; }
    /// Watches the following error. Returns true when it lasts for the time of 6066h.
    bool watch_following(double dt, bool torque_on) noexcept;
    void watch_speed(double dt) noexcept;
    /// Reads switches and probes along the travel; `external` are further inputs.
    void read_inputs(std::uint32_t external) noexcept;

    const MotionModes::Monitored& result() const noexcept { return result_; }
    std::uint32_t inputs() const noexcept { return inputs_; }
    /// Returns true when an input has changed to `level` with the last step.
    bool changed_to(std::uint32_t input, bool level) const noexcept {
        return ((inputs_ ^ inputs_before_) & input) != 0 && ((inputs_ & input) != 0) == level;
    }
    /// Returns the distance of the position from its demand, increments; 0 in other loops.
    double following_error() const noexcept;

private:
    const Drivetrain& train_;
    const AxisValues& values_;
    MotionModes::Monitored result_;
    double following_time_ = 0;
    double speed_zero_time_ = 0;
    std::uint32_t inputs_ = 0;
    std::uint32_t inputs_before_ = 0;
};

}  // namespace hal::cia402
