// SPDX-License-Identifier: MIT
// The timing diagram of a schedule, as a picture.
#pragma once

#include <string>

#include "fieldbus/tdma/config/schedule_plan.hpp"

namespace hal::tools {

/// SVG of a cycle and a third: a row per station, its thread's beginning, its frames with the way through the switch. The same schedule
/// gives the same text. [setup]
std::string picture_of(const tdma::config::Schedule&, const tdma::plan::Plan&);

}  // namespace hal::tools
