// SPDX-License-Identifier: MIT
// One device as a process: opens the bus, turns the node until somebody ends it, says what happens.
#pragma once

#include <functional>
#include <string>

#include "bus/node/node_options.hpp"
#include "canopen/device/program.hpp"

namespace hal::tools {

/// What kind of device it is, in words.
struct NodeKind {
    std::string name;     ///< "drive"
    std::string what;     ///< "CiA 402, 2 axes"
    std::uint8_t id = 0;  ///< node-id when none is given; 0: one must be given
    std::function<std::string()> keep = {};  ///< called in every turn: writes to disk what shall outlast the process. What is wrong, or nothing
};

/// Runs it, or prints its EDS, as the options say. Returns the exit code.
int run_node(const NodeOptions&, const NodeKind&, canopen::Program&);

}  // namespace hal::tools
