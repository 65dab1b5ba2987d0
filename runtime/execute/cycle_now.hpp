// SPDX-License-Identifier: MIT
// What the virtual clocks of this process are doing, for a thread that watches them.
#pragma once

#include <cstdint>

#include "execute/core.hpp"

namespace hal {

/// The cycle that is in the middle of a function; no core: there is none.
struct CycleNow {
    const Core* core = nullptr;
    std::uint64_t cycle = 0;
    std::uint32_t function = 0;  ///< the model's number
};
/// Of any executor with a virtual clock; from any thread but those that run cycles.
CycleNow cycle_now();
/// Waits until no cycle_now() reads a core or its plan: what was removed or replaced before may go. [setup]
void fence_cycle_now();

}  // namespace hal
