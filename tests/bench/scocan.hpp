// SPDX-License-Identifier: MIT
#pragma once

#include "bench.hpp"

namespace hal::bench {

void scocan(const Options&, Report&);

}  // namespace hal::bench
