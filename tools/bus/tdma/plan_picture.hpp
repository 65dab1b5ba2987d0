// SPDX-License-Identifier: MIT
// The timing diagram of a schedule, as a picture.
#pragma once

#include <string>

#include "fieldbus/tdma/config/schedule_plan.hpp"

namespace hal::tools {

/// Returns the SVG of a cycle and a third: a row per station, its thread, its frames and their
/// transit through the switch. The same schedule gives the same text. [setup]
std::string picture_of(const tdma::config::Schedule&, const tdma::plan::Plan&);

}  // namespace hal::tools
