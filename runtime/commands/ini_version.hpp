// SPDX-License-Identifier: MIT
// The version of a LinuxCNC configuration.
#pragma once

#include <string>

#include "netlist/netlist.hpp"

namespace hal {

/// True for the configuration of a whole LinuxCNC machine: its INI file names parts that only
/// LinuxCNC's launcher starts.
bool is_linuxcnc_configuration(const Ini& ini);
/// Returns why LinuxCNC 2.9 and later do not start the configuration before it is converted, or "".
std::string ini_version_problem(const Ini& ini);

}  // namespace hal
