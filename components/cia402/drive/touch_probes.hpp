// SPDX-License-Identifier: MIT
// Touch probes 1 and 2 (60B8h to 60BDh): they latch the position at an edge of an input or at an
// index pulse.
#pragma once

#include <array>
#include <optional>

#include "cia402/drive/axis_monitor.hpp"

namespace hal::cia402 {

/// Both probes. [realtime]
class TouchProbes {
public:
    /// All must outlive it. [setup]
    TouchProbes(const Drivetrain& train, const AxisMonitor& inputs, AxisValues& values) noexcept
        : train_(train), inputs_(inputs), values_(values) {}

    void power_up() noexcept;
    /// Evaluates the last step.
    void step() noexcept;

private:
    void step_probe(unsigned n, unsigned function, unsigned before, std::uint8_t& status) noexcept;
    void arm(unsigned n, unsigned function, unsigned before, std::uint8_t& status) noexcept;
    std::optional<double> latched(unsigned n, bool rising, bool index) const noexcept;

    const Drivetrain& train_;
    const AxisMonitor& inputs_;
    AxisValues& values_;
    std::uint16_t function_before_ = 0;
    std::array<std::uint8_t, 2> armed_{};  // edges not found yet
};

}  // namespace hal::cia402
