// SPDX-License-Identifier: MIT
// The timing diagram of a schedule.
#pragma once

#include "bus/timeline/timeline.hpp"
#include "fieldbus/tdma/config/schedule_plan.hpp"

namespace hal::tools {

/// Returns a cycle and a third: a lane per station, its thread, its frames and their transit
/// through the switch. [setup]
Timeline timeline_of(const tdma::config::Schedule&, const tdma::plan::Plan&);

}  // namespace hal::tools
