// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/abi.h"
#include "text/diagnostic.hpp"

namespace hal {

struct Plugin {
    const hal_component* component = nullptr;
    std::shared_ptr<void> library;  ///< keeps it loaded
    std::string path;
};

/// ~/.local/share/halcyon/KIND, or below $XDG_DATA_HOME: `components` and `bin`, where `hal
/// compile` installs. Empty: there is no home.
std::string user_folder(std::string_view kind);

/// Finds and opens plugins. The only place that calls dlopen; only folders of the search path are
/// looked in.
class Plugins {
public:
    /// `first`: folders searched before HALCYON_PLUGIN_PATH, the user's folder, the build tree and
    /// the installation.
    explicit Plugins(std::vector<std::string> first = {});
    /// The plugin of that name (`-` and `_` are the same), built first where build_on_demand() does
    /// that; nothing after reporting no-such-component or bad-plugin.
    std::optional<Plugin> open(std::string_view name, Span at, Diagnostics& diagnostics) const;
    /// Returns the file of the plugin of that name; empty when it is missing.
    std::string find(std::string_view name) const;
    /// Every name that open() would find or build, sorted.
    std::vector<std::string> available() const;
    const std::vector<std::string>& path() const { return path_; }

private:
    std::vector<std::string> path_;
};

}  // namespace hal
