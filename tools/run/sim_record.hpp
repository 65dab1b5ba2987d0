// SPDX-License-Identifier: MIT
#pragma once

#include "run/hosted_machine.hpp"
#include "run/sim.hpp"

namespace hal::tools {

/// Advances by --for or --cycles and records meanwhile: the same netlist gives the same file. Returns the exit status.
int record_advance(const SimOptions& options, HostedMachine& machine);

}  // namespace hal::tools
