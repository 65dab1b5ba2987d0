// SPDX-License-Identifier: MIT
// For components of buses: reports the path delay of the values of their pins, for `show latency`.
#pragma once

#include "hal/component.hpp"
#include "hal/way.h"

namespace hal {

/// In start(): the value of this pin (named below the instance) goes to or comes from `far`, in words; see hal/way.h. Nothing happens where
/// nobody asks for it. [setup]
inline void tell_way(const char* pin, const char* far, std::uint32_t cycles, std::uint32_t round_trip, std::int64_t worst_ns) {
    const auto* way = extension<hal_way>(HAL_WAY);
    if (way != nullptr) way->tell(way, detail::creating, pin, far, cycles, round_trip, worst_ns);
}

}  // namespace hal
