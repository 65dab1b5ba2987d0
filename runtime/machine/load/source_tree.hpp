// SPDX-License-Identifier: MIT
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

/// The source tree a program was built in: what it has is known before all of it is built.
namespace hal {

struct ComponentSummary {
    std::string group;    ///< the folder of its source, below components/
    std::string summary;  ///< one line
};

/// The components that the build lists in the file `groups` of these plugin folders, built or not.
std::map<std::string, ComponentSummary> listed_components(const std::vector<std::string>& folders);

/// Returns the Debian package of Halcyon that has the components of this group: `halcyon-vision`;
/// empty for the package `halcyon` (tools/package/packages.py).
std::string debian_package(std::string_view group);

/// Builds a component, or `bus`, the program of the bus tools, with the script in $HALCYON_BUILD;
/// progress is printed to stderr. False when this program was not started by that script, after
/// forbid_builds(), and when the build failed. [setup]
bool build_on_demand(const std::string& name);

/// Disables build_on_demand() for the rest of this process: compilers must not disturb running
/// threads. [any]
void forbid_builds() noexcept;

}  // namespace hal
