// SPDX-License-Identifier: MIT
// What the torch height controls thc and thcud share: when a correction is allowed, and how it goes away again.
#pragma once

#include <algorithm>
#include <cmath>

namespace torch {

/// Within `percent` of the requested velocity: the torch is not in a corner, its voltage means height. [realtime]
inline bool at_velocity(double current, double requested, double percent) noexcept {
    return std::fabs(current - requested) <= std::fabs(requested) * percent / 100.0;
}

/// The correction of Z.
class Offset {
public:
    double value() const noexcept { return value_; }
    void clear() noexcept { value_ = 0.0; }
    /// Adds `step`; one that is not finite, or leaves a machine's range, counts nothing. [realtime]
    void correct(double step) noexcept {
        if (const double next = value_ + step; std::fabs(next) <= 1e9) value_ = next;
    }
    /// Takes away what Z's own way up of this cycle covers; true while there is something left to take. [realtime]
    bool remove(double way_up) noexcept {
        if (value_ == 0.0) return false;
        if (way_up > 0.0) value_ -= std::clamp(value_, -way_up, way_up);
        return true;
    }

private:
    double value_ = 0.0;
};

}  // namespace torch
