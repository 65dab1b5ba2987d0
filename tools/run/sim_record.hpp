// SPDX-License-Identifier: MIT
#pragma once

#include "run/hosted_machine.hpp"
#include "run/sim.hpp"

namespace hal::tools {

/// States what speaks against the file of --record, before anything is loaded. Returns the exit status.
int check_recording(const SimOptions& options);

/// Advances by --for or --cycles and records meanwhile: the same netlist gives the same file. Returns the exit status.
int record_advance(const SimOptions& options, HostedMachine& machine);

}  // namespace hal::tools
