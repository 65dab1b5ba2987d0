// SPDX-License-Identifier: MIT
// The pins of a touch probe of the component cia402: those of its user, and the positions that the
// drive latched.
#pragma once

#include <cstdint>
#include <string>

#include "cia402/axis.hpp"
#include "cia402/touch_probe.hpp"
#include "hal/component.hpp"

namespace hal::cia402 {

class ProbePins {
public:
    /// Declares the pins of probe 1 or 2. [setup]
    ProbePins(hal::Component& component, unsigned number)
        : ProbePins(component, "probe-" + std::to_string(number) + "-",
                    "touch-probe-" + std::to_string(number) + "-", number == 1 ? "60BAh" : "60BCh",
                    number == 1 ? "60BBh" : "60BDh") {}

    /// Takes the byte of 60B9h of this probe and the latched positions. [realtime]
    void read(bool operational, std::uint8_t status, const Axis& axis,
              const AxisRules& rules) noexcept {
        probe_.observe({operational, status, rising_, falling_});
        armed_ = probe_.armed();
        latched_ = probe_.latched();
        if (const auto count = probe_.position(); probe_.latched() && count) {
            position_ = axis.position_of(*count, rules);
        }
    }
    /// Returns the byte of 60B8h of this probe. [realtime]
    std::uint8_t write() noexcept {
        const std::uint8_t function = probe_.act({enable_, on_falling_, continuous_, on_index_});
        armed_ = probe_.armed();
        latched_ = probe_.latched();
        return function;
    }

private:
    ProbePins(hal::Component& c, const std::string& user, const std::string& drive,
              const char* rising, const char* falling)
        : enable_(
              c, (user + "enable").c_str(),
              "TRUE arms the probe of the drive, FALSE releases it; a rising edge arms it again"),
          on_falling_(c, (user + "falling").c_str(),
                      "TRUE: latches at the falling edge of the input; FALSE: at the rising one"),
          continuous_(c, (user + "continuous").c_str(),
                      "TRUE: latches at each edge; FALSE: at the first one"),
          on_index_(c, (user + "index").c_str(),
                    "TRUE: latches at the index pulse of the encoder; FALSE: at the input"),
          armed_(c, (user + "armed").c_str(), "the drive waits for the edge, or has latched it",
                 {.safe = false}),
          latched_(c, (user + "latched").c_str(),
                   "a position was latched since the probe was armed", {.safe = false}),
          position_(c, (user + "position").c_str(), "position that was latched last",
                    {.finite = true}),
          rising_(c, (drive + "positive-edge").c_str(), rising),
          falling_(c, (drive + "negative-edge").c_str(), falling) {}

    hal::In<bool> enable_, on_falling_, continuous_, on_index_;
    hal::Out<bool> armed_, latched_;
    hal::Out<double> position_;
    hal::In<std::int32_t> rising_, falling_;
    TouchProbe probe_;
};

}  // namespace hal::cia402
