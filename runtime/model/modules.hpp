// SPDX-License-Identifier: MIT
// What the rules of the graph know about LinuxCNC's modules.
#pragma once

#include "hal/modules.h"
#include "model/model.hpp"

namespace hal {

inline bool is_module(const LoadedComponent& component) {
    return component.plugin && (component.plugin->flags & HAL_COMPONENT_MODULE);
}

/// Whether an instance uses its pins in threads of its own.
inline bool has_own_threads(const Model& model) {
    for (const auto& component : model.components) {
        for (const auto& instance : component->instances) {
            if (instance->own_threads) return true;
        }
    }
    return false;
}

/// Whether a loaded module made the thread.
inline bool made_by_module(const Thread& thread, const Model& model) {
    if (!thread.made.known()) return false;
    for (const auto& component : model.components) {
        if (is_module(*component) && component->loaded.source == thread.made.source &&
            component->loaded.begin == thread.made.begin) {
            return true;
        }
    }
    return false;
}

}  // namespace hal
