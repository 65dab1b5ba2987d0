// SPDX-License-Identifier: MIT
#pragma once

#include "bench.hpp"

namespace hal::bench {

/// Section `ethercat`.
void ethercat(const Options&, Report&);

/// Its part in memory: many slaves, faults, the shortest cycle of a machine.
void ethercat_machines(const Options&, Report&);

}  // namespace hal::bench
