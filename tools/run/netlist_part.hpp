// SPDX-License-Identifier: MIT
// A netlist that is a part of another one: that one reads it with `source`, or an INI file lists
// it behind others.
#pragma once

#include <string>
#include <vector>

namespace hal::tools {

/// The files of the same folder that read this netlist, in the order of their names: paths as they
/// can be typed. Empty: none does, or the folder cannot be read. [setup]
std::vector<std::string> files_that_read(const std::string& netlist);

}  // namespace hal::tools
