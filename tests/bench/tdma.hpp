// SPDX-License-Identifier: MIT
#pragma once

#include "bench.hpp"

namespace hal::bench {

void time_slots(const Options&, Report&);
void cnc(const Options&, Report&);

}  // namespace hal::bench
