// SPDX-License-Identifier: MIT
// What a plugin's file says of itself, read before the loader touches it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hal {

struct PluginFile {
    std::string problem;               ///< why it cannot be loaded; empty: nothing is known against it
    std::vector<std::string> needed;   ///< the shared libraries it names, as DT_NEEDED has them
};

/// Reads the file at `path`. The loader touches what the headers promise and dies (SIGBUS) where a cut file ends; this does not.
PluginFile read_plugin_file(const std::string& path);

/// Loads those of `needed` that belong to Halcyon (libhalcyon_*) from where they lie relative to this program or to the plugin's folder, so
/// that the plugin finds them loaded. A plugin carries no path to them: the build tree and the installation may be moved, and the loader
/// ignores $ORIGIN in a program with file capabilities. One that is not found is left to the loader.
void load_own_libraries(const std::vector<std::string>& needed, const std::string& plugin_folder);

/// The loader's sentence, or what it means where it is about a symbol that ties a plugin to a library of its own build.
std::string reason_of_loader(const std::string& why);

/// What to do about a plugin that was rejected with the sentence `why`.
std::string help_for_loader(const std::string& why);

}  // namespace hal
