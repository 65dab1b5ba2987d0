// SPDX-License-Identifier: MIT
// The hand-written loops the runtime is measured against.
#pragma once

#include <cstddef>
#include <string_view>

#include "hal/abi.h"

namespace hal::bench {

/// Calls the function of each instance, inlined: instances of one component, through pointers to
/// the very structs the runtime made, in its order.
using Loop = void (*)(void* const* instances, std::size_t count, const hal_cycle* cycle);

/// The loop over a component: and2, sum2, mux2, limit1 or pid.
Loop loop_over(std::string_view component);

}  // namespace hal::bench
