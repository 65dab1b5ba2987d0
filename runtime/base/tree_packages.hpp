// SPDX-License-Identifier: MIT
// The packages of the source tree: what a build may leave out beside the core. CMake writes the
// list, from cmake/packages.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace hal {

enum class PackageState {
    built,
    switched_off,  ///< by -DHALCYON_PACKAGE_NAME=OFF
    incomplete,    ///< something that it is built with is missing
};

struct TreePackage {
    std::string_view name;
    std::string_view summary;
    PackageState state;
    std::string_view needs;  ///< what is missing, often a Debian package; empty: nothing is

    bool built() const { return state == PackageState::built; }
    /// Returns why this build does not have the package; "" if it has. [setup]
    std::string reason() const;
    /// Returns what to type so that the next build has it; "" if nothing helps. [setup]
    std::string remedy() const;
    /// Returns the reason and the remedy. [setup]
    std::string problem() const;
};

extern const std::span<const TreePackage> tree_packages;

/// Returns the package of this name, or nullptr. [any]
const TreePackage* find_tree_package(std::string_view name);

/// Returns the switch of a package: HALCYON_PACKAGE_ETHERCAT. [setup]
std::string package_switch(std::string_view name);

}  // namespace hal
