// SPDX-License-Identifier: MIT
// A plugin is tried before it is installed, by the host that will load it.
#pragma once

#include <string>

#include "comp/build_plugin.hpp"

namespace hal::tools {

/// Loads the plugin `name` of `folder` as `loadrt` does, and where nothing is acquired by it (no
/// start or stop) runs its functions for a few cycles of a virtual clock; in a process of its own:
/// all of it is the author's code. Fills in `built`. False: `built.problem` has the reason, with
/// file and line of `source` where they are known.
bool try_plugin(const std::string& folder, const std::string& name, const PluginSource& source,
                BuiltPlugin& built);

/// What the compiler printed without the error that follows from others: that using
/// Component::Component is missing, where it is not.
std::string without_false_hint(const std::string& messages, const PluginSource& source);

}  // namespace hal::tools
