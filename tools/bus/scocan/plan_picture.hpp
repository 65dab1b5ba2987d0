// SPDX-License-Identifier: MIT
// The timeline of a SCoCAN table, as a picture.
#pragma once

#include <string>

#include "fieldbus/scocan/plan/plan.hpp"

namespace hal::tools {

/// Returns the SVG of a cycle: the slots and what leaves in them, and a bar per message: its
/// worst-case latency with slots and on plain CAN. The same table gives the same text. [setup]
std::string picture_of(const scocan::Table&, const scocan::plan::Plan&);

}  // namespace hal::tools
