// SPDX-License-Identifier: MIT
// LinuxCNC's compiled modules: finds them in its module folder and opens them by
// libhalcyon_modules.so, which is loaded at the first one.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "machine/plugins.hpp"

namespace hal {

/// Where `loadrt` takes a component from.
enum class Origin { any, native, linuxcnc };

/// Plugins::open(), which is for any origin: a LinuxCNC module where there is no plugin.
std::optional<Plugin> open_component(const Plugins& plugins, std::string_view name, Origin origin,
                                     Span at, Diagnostics& diagnostics);

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
/// Reads the module's file; its code is not mapped before its instance is created. Nothing after
/// reporting bad-plugin.
std::optional<Plugin> open_module(const std::string& name, Span at, Diagnostics& diagnostics);
/// Returns the name of a loaded module that uses symbols of this one; empty: none. `component` is a
/// module's. The name of the module whose task, a thread of its own, calls this; nullptr in all
/// other threads. async-signal-safe.
const char* module_of_task() noexcept;

std::string user_of_module(const hal_component& component, std::size_t index);

}  // namespace hal
