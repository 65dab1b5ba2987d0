// SPDX-License-Identifier: MIT
#pragma once

#include "run/hosted_machine.hpp"
#include "run/sim.hpp"

namespace hal::tools {

/// Advances as --for or --cycles say and records meanwhile: the same file from the same netlist, but for the dates in it. Returns the exit status.
int record_advance(const SimOptions& options, HostedMachine& machine);

}  // namespace hal::tools
