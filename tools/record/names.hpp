// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "control/client.hpp"

namespace hal::tools {

/// Returns the values that names and patterns like 'x-*' stand for, in their order, each once. On a
/// pattern without a match returns nothing and sets `problem`. Names are passed on as they are: the
/// instance knows what is similar.
std::vector<std::string> probed_names(Client& client, const std::vector<std::string>& wanted,
                                      std::string& problem);

/// Returns the signals and the pins and parameters without one of a component, an instance, a
/// thread or a netlist file (with or without its folder). When there are none, sets `problem`.
std::vector<std::string> group_names(Client& client, const std::string& group,
                                     std::string& problem);

/// Returns all signals, and all pins and parameters that have no signal.
std::vector<std::string> all_names(Client& client);

}  // namespace hal::tools
