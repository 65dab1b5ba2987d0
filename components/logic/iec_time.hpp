// SPDX-License-Identifier: MIT
// Elapsed time for the IEC 61131-3 timers ton, tof and tp: counted in whole cycles, so that rounding errors do not accumulate.
#pragma once

#include "hal/component.hpp"

namespace iec {

/// Elapsed time of a timer, limited to its preset time.
class Elapsed {
public:
    /// Adds one cycle. [realtime]
    void advance(std::int64_t period_ns) noexcept { ns_ += ns_ < (std::int64_t{1} << 62) ? period_ns : 0; }
    void restart() noexcept { ns_ = 0; }
    /// Returns true once `seconds` have elapsed; NaN counts as 0. [realtime]
    bool reached(double seconds) const noexcept { return !(value() < seconds); }
    double limited(double seconds) const noexcept { return reached(seconds) ? std::fmax(seconds, 0.0) : value(); }

private:
    double value() const noexcept { return static_cast<double>(ns_) / 1e9; }
    std::int64_t ns_ = 0;
};

}  // namespace iec
