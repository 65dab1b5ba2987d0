// SPDX-License-Identifier: MIT
// The timing diagram of a SCoCAN table.
#pragma once

#include "bus/timeline/timeline.hpp"
#include "fieldbus/scocan/plan/plan.hpp"

namespace hal::tools {

/// Returns a cycle: a lane per node with its private slots and their frames, one of the shared
/// slots, and the worst-case latency of each message with slots and on plain CAN. [setup]
Timeline timeline_of(const scocan::Table&, const scocan::plan::Plan&);

}  // namespace hal::tools
