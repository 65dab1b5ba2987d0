// SPDX-License-Identifier: MIT
// The plugins that a session can load, and the streams of the instances it has loaded.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "hal/abi.h"
#include "machine/load/declared.hpp"

namespace hal {

struct Model;
class Plugins;

/// Part of a Session. [setup]
class PluginHost {
public:
    PluginHost(const Model& model, const Plugins& plugins) : model_(model), plugins_(plugins) {}

    /// Returns the names of all components that can be loaded from the search path, sorted.
    std::vector<std::string> available_components() const;
    /// Returns what a component declares with default arguments; nothing when it cannot be
    /// constructed with them.
    std::optional<Declared> declared(std::string_view component) const;
    /// Returns the stream of that name of a loaded instance, or nullptr.
    hal_stream* find_stream(std::string_view name) const;
    std::vector<std::string> stream_names() const;

private:
    const Model& model_;
    const Plugins& plugins_;
};

}  // namespace hal
