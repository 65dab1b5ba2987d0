// SPDX-License-Identifier: MIT
#pragma once

#include "bench.hpp"

namespace hal::bench {

/// The section `ethernet`.
void raw_ethernet(const Options&, Report&);

}  // namespace hal::bench
