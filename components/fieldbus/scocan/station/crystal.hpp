// SPDX-License-Identifier: MIT
// The clock of a simulated node: its rate error against the time of the bus, and the resolution of
// its time stamps.
#pragma once

#include <cmath>

#include "fieldbus/scocan/config/table.hpp"

namespace hal::scocan {

struct Crystal {
    double ppm = 0;
    Time tick = 0;   ///< of received stamps, ns; 0: exact
    Time epoch = 0;  ///< bus time at which both clocks agree

    Time local(Time bus) const noexcept {
        return ppm == 0 ? bus : bus + std::llround(static_cast<double>(bus - epoch) * ppm * 1e-6);
    }
    Time bus(Time local) const noexcept {
        return ppm == 0
                   ? local
                   : epoch + std::llround(static_cast<double>(local - epoch) / (1 + ppm * 1e-6));
    }
    /// Returns the time stamp of an event at a time of the bus. [realtime]
    Time stamp(Time bus_time) const noexcept {
        const Time exact = local(bus_time);
        return tick <= 1 ? exact : exact - (exact % tick + tick) % tick + tick / 2;
    }
};

}  // namespace hal::scocan
