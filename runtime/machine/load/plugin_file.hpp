// SPDX-License-Identifier: MIT
// Checks a plugin's file before the dynamic loader maps it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hal {

struct PluginFile {
    /// why it cannot be loaded; empty: nothing is known against it
    std::string problem;
    std::vector<std::string> needed;   ///< the shared libraries it names, as DT_NEEDED has them
};

/// Reads the file at `path`. The loader touches what the headers promise and dies (SIGBUS) where a
/// cut file ends; this does not.
PluginFile read_plugin_file(const std::string& path);

/// Loads those of `needed` that belong to Halcyon (libhalcyon_*) from where they lie relative to
/// this program or to the plugin's folder, so that the plugin finds them loaded. A plugin carries
/// no path to them: the build tree and the installation may be moved, and the loader ignores
/// $ORIGIN in a program with file capabilities. One that is not found is left to the loader.
void load_own_libraries(const std::vector<std::string>& needed, const std::string& plugin_folder);

/// Why a plugin is rejected, and what to do about it.
struct PluginProblem {
    std::string why;
    std::string help = "rebuild it against this version's hal/component.hpp";
};

/// Explains an error message of dlopen() about the plugin at `path`. The format of these messages
/// is the C library's.
PluginProblem explain_loader_error(std::string message, const std::string& path);

}  // namespace hal
