// SPDX-License-Identifier: MIT
// For components of buses: reports the path delay of the values of their pins, for `show latency`.
#pragma once

#include "hal/component.hpp"
#include "hal/path_delay.h"

namespace hal {

/// Reports, in start(), the delay of a pin's value (named below the instance) on its path to or
/// from `far`, a name for the reader; see hal/path_delay.h. Does nothing where the host does not
/// offer the extension. [setup]
inline void report_path_delay(const char* pin, const char* far, std::uint32_t cycles,
                              std::uint32_t round_trip, std::int64_t worst_ns) {
    const auto* host = extension<hal_path_delay>(HAL_PATH_DELAY);
    if (host != nullptr) {
        host->report(host, detail::creating, pin, far, cycles, round_trip, worst_ns);
    }
}

}  // namespace hal
