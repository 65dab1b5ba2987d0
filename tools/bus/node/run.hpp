// SPDX-License-Identifier: MIT
// A device as a process: opens the bus, turns the node until a signal arrives, prints events.
#pragma once

#include <functional>
#include <string>

#include "bus/node/node_options.hpp"
#include "canopen/device/program.hpp"

namespace hal::tools {

/// Description of a kind of device.
struct NodeKind {
    std::string name;     ///< "drive"
    std::string what;     ///< "CiA 402, 2 axes"
    std::uint8_t id = 0;  ///< default node ID; 0: --id is required
    /// called in every turn to save persistent state; returns the problem, or ""
    std::function<std::string()> keep = {};
};

/// Runs the device, or prints its EDS, as in the options. Returns the exit code.
int run_node(const NodeOptions&, const NodeKind&, canopen::Program&);

}  // namespace hal::tools
