// SPDX-License-Identifier: MIT
// Opens LinuxCNC's compiled modules by libhalcyon_modules.so, which is loaded at the first one.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "hal/modules.h"
#include "linuxcnc/find/modules.hpp"
#include "machine/load/plugins.hpp"
#include "model/model.hpp"

namespace hal {

/// Plugins::open(), which is for any origin: a LinuxCNC module where there is no plugin.
std::optional<Plugin> open_component(const Plugins& plugins, std::string_view name, Origin origin,
                                     Span at, Diagnostics& diagnostics);

/// True if a LinuxCNC module was loaded as this component.
inline bool is_module(const LoadedComponent& component) {
    return component.plugin && (component.plugin->flags & HAL_COMPONENT_MODULE);
}

/// Reads the module's file; its code is not mapped before its instance is created. Nothing after
/// reporting bad-plugin.
std::optional<Plugin> open_module(const std::string& name, Span at, Diagnostics& diagnostics);
/// Returns the name of the module whose task, a thread of its own, calls this; nullptr in all other
/// threads. async-signal-safe
const char* module_of_task() noexcept;
/// Returns the name of a loaded module that uses symbols of this one; empty: none. `component` is a
/// module's.
std::string user_of_module(const hal_component& component, std::size_t index);

}  // namespace hal
