// SPDX-License-Identifier: MIT
// Where LinuxCNC's compiled modules are, and whether `loadrt` prefers them.
#pragma once

#include <string>
#include <string_view>

namespace hal {

/// Where `loadrt` takes a component from.
enum class Origin { any, native, linuxcnc };

/// Where a `loadrt` without an option takes this component from: linuxcnc if HALCYON_MODULES is
/// "linuxcnc" and there is such a module, else any.
Origin usual_origin(std::string_view name);

/// True when HALCYON_MODULES is "linuxcnc".
bool prefers_modules();
/// The value of HALCYON_MODULES if it is set to something that has no meaning; else an empty
/// string.
std::string meaningless_preference();

/// $HAL_RTMOD_DIR, or where the package linuxcnc-uspace installs them.
std::string module_folder();
/// Returns the name of the module's file without its folder and `.so` (`-` and `_` are the same);
/// an empty string if the folder has no such file.
std::string find_module(std::string_view name);

}  // namespace hal
