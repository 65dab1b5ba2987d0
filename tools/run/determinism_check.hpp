// SPDX-License-Identifier: MIT
// `hal check --deterministic`: which components compute something else from the same inputs.
#pragma once

#include "run/check.hpp"

namespace hal::tools {

/// Environment variable of the two simulations: the seed of `rand`, another one in each. Functions
/// that read sockets are reported, and with an odd seed the threads get new plans in the middle.
inline constexpr const char* determinism_seed = "HALCYON_DETERMINISM_SEED";

/// Checks the netlists, simulates them twice in two processes that differ in all that a cycle must
/// not depend on (addresses, content of fresh memory, time), and compares all values. Returns 0
/// when they are equal. [setup]
int run_determinism_check(const CheckOptions& options);

}  // namespace hal::tools
