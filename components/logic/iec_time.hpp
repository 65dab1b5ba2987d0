// SPDX-License-Identifier: MIT
// The timers ton, tof and tp of IEC 61131-3: time that passes in whole cycles, without rounding that adds up.
#pragma once

#include "hal/component.hpp"

namespace iec {

/// Elapsed time of a timer, limited to what it waits for.
class Elapsed {
public:
    /// Another cycle has passed. [realtime]
    void advance(std::int64_t period_ns) noexcept { ns_ += ns_ < (std::int64_t{1} << 62) ? period_ns : 0; }
    void restart() noexcept { ns_ = 0; }
    /// A NaN time counts as 0. [realtime]
    bool reached(double seconds) const noexcept { return !(value() < seconds); }
    double limited(double seconds) const noexcept { return reached(seconds) ? std::fmax(seconds, 0.0) : value(); }

private:
    double value() const noexcept { return static_cast<double>(ns_) / 1e9; }
    std::int64_t ns_ = 0;
};

}  // namespace iec
