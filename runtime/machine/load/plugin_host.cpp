// SPDX-License-Identifier: MIT
#include "machine/load/plugin_host.hpp"

#include "machine/load/plugins.hpp"
#include "model/model.hpp"

namespace hal {

hal_stream* PluginHost::find_stream(std::string_view name) const {
    for (const auto& component : model_.components) {
        for (const auto& instance : component->instances) {
            for (const auto& [stream_name, stream] : instance->streams) {
                if (stream_name == name) return stream;
            }
        }
    }
    return nullptr;
}

std::vector<std::string> PluginHost::stream_names() const {
    std::vector<std::string> names;
    for (const auto& component : model_.components) {
        for (const auto& instance : component->instances) {
            for (const auto& [name, stream] : instance->streams) {
                names.push_back(name);
            }
        }
    }
    return names;
}

std::vector<std::string> PluginHost::available_components() const { return plugins_.available(); }

std::optional<Declared> PluginHost::declared(std::string_view component) const {
    Diagnostics ignored;
    const LoadedComponent* const loaded = model_.find_component(component);
    const std::optional<Plugin> plugin = loaded && loaded->plugin
                                             ? Plugin{loaded->plugin, loaded->library, loaded->path}
                                             : plugins_.open(component, {}, ignored);
    Declared found;
    std::string problem;
    if (!plugin || !gather(*plugin->component, found, problem)) {
        return {};
    }
    return found;
}

}  // namespace hal
