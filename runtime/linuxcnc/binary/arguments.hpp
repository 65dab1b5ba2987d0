// SPDX-License-Identifier: MIT
// The arguments of a module: what loadrt gives as NAME=VALUE goes into the module's variables.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "linuxcnc/binary/module_host.hpp"

namespace hal::modules {

/// Sets the variables of the mapped library. Texts that they point to are added to `texts` and must
/// stay as long as the library. Returns false after rejecting one.
bool apply_arguments(const hal_host* host, void* library,
                     std::span<const halcyon_module_parameter> parameters,
                     std::vector<std::unique_ptr<char[]>>& texts);

}  // namespace hal::modules
