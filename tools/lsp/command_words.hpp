// SPDX-License-Identifier: MIT
// What the words of a command stand for, from its usage in the command table.
#pragma once

#include <string_view>
#include <vector>

#include "netlist/netlist.hpp"

namespace hal::tools {

/// Returns for each argument its word of the usage ("SIGNAL", "PIN", "COMPONENT|INSTANCE|all"), ""
/// for an arrow and for what no word describes. Empty for an unknown command. [setup]
std::vector<std::string_view> usage_of_arguments(const Command& command);

/// Returns whether one of the alternatives of a usage word ("COMPONENT|all") is this one.
bool has_alternative(std::string_view usage_word, std::string_view alternative);

}  // namespace hal::tools
