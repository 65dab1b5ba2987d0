// SPDX-License-Identifier: MIT
// Netlists for several machines: their nodes, all of them in this process, the part of one.
#pragma once

#include <optional>

#include "cells/cell.hpp"
#include "run/hosted_machine.hpp"
#include "run/run.hpp"
#include "run/sim.hpp"

namespace hal::tools {

/// Returns the nodes of the files of `options`, none for a netlist of one machine; nullopt after
/// printing an error in --node.
std::optional<std::vector<NodeLine>> requested_nodes(const NetlistOptions& options);

/// Checks all nodes. Returns the exit code.
int check_cell(const NetlistOptions& options, std::vector<NodeLine> nodes);

/// Runs all nodes on the virtual clock in this process, or options.part alone, with the others
/// offline. Returns the exit code.
int sim_cell(const SimOptions& options, std::vector<NodeLine> nodes);

/// Loads the part of options.part into the machine, with what it needs for the signals of the
/// others. Returns the exit status.
int load_node(HostedMachine& machine, const RunOptions& options, std::vector<NodeLine> nodes);

}  // namespace hal::tools
