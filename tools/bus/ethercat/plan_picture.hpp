// SPDX-License-Identifier: MIT
// The timing diagram of an EtherCAT bus.
#pragma once

#include "bus/timeline/timeline.hpp"
#include "ethercat/config/plan.hpp"

namespace hal::tools {

/// Returns two or three cycles: lanes for thread, wire and slaves, with SYNC0, and the worst case
/// from input to output. [setup]
Timeline timeline_of(const ethercat::config::Bus&, const ethercat::config::Plan&,
                     const ethercat::config::PlanOptions&);

}  // namespace hal::tools
