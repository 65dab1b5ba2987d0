// SPDX-License-Identifier: MIT
// Which netlist a file of an editor belongs to: a part is loaded by the netlist or the INI file
// that names it, the configuration of a bus by a component.
#pragma once

#include <string>

#include "lsp/checked_netlist.hpp"

namespace hal::tools {

/// Files that a component reads, by their endings.
struct ConfigurationKind {
    const char* ending;     ///< ".canopen"
    const char* component;  ///< loaded with config=FILE
};

/// Returns nullptr for a netlist, an INI file and everything else.
const ConfigurationKind* configuration_kind(const std::string& path);

/// Returns the path, and the command if there is one, of what has to be loaded for the diagnostics
/// of a file: reads the folder of the file. [setup]
NetlistRoot find_root(const std::string& path);

/// True for an INI file that runs netlists, or a configuration of LinuxCNC.
bool names_netlists(const std::string& ini_path);

}  // namespace hal::tools
