// SPDX-License-Identifier: MIT
// The section `mesa`.
#pragma once

#include "bench.hpp"

namespace hal::bench {

void mesa_card(const Options&, Report&);

}  // namespace hal::bench
