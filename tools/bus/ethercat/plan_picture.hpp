// SPDX-License-Identifier: MIT
// The timing diagram of an EtherCAT bus.
#pragma once

#include <string>

#include "ethercat/config/plan.hpp"

namespace hal::tools {

/// Returns an SVG: thread, wire and slaves over two cycles, with SYNC0 and the worst case from
/// input to output. [setup]
std::string ethercat_plan_picture(const ethercat::config::Bus&, const ethercat::config::Plan&,
                                  const ethercat::config::PlanOptions&);

}  // namespace hal::tools
