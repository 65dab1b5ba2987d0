// SPDX-License-Identifier: MIT
// The preset time of the IEC 61131-3 timers ton, tof and tp.
#pragma once

#include "hal/corrected.hpp"

namespace iec {

/// The parameter `pt`, s.
class PresetTime : public hal::CorrectedParam<double> {
public:
    using CorrectedParam::CorrectedParam;
    /// Sets a negative time to 0. [realtime]
    void correct_sign() noexcept {
        if (get() < 0.0) {
            correct(0.0);
        }
    }
};

}  // namespace iec
