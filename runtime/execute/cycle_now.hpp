// SPDX-License-Identifier: MIT
// The cycles that the virtual clocks of this process are running, for a supervising thread.
#pragma once

#include <cstdint>

#include "execute/core.hpp"

namespace hal {

/// The cycle that is running a function; without a core: none.
struct CycleNow {
    const Core* core = nullptr;
    std::uint64_t cycle = 0;
    std::uint32_t function = 0;  ///< the model's number
};
/// Returns the running cycle of any executor with a virtual clock. Not called by threads that run
/// cycles.
CycleNow cycle_now();
/// Waits until no cycle_now() reads a core or its plan; whatever was removed or replaced before can
/// then be freed. [setup]
void fence_cycle_now();

}  // namespace hal
