// SPDX-License-Identifier: MIT
// How the model owns its objects. Internal to edits.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "model/model.hpp"

namespace hal {

/// Returns the place of the owner of `one`, or end().
template <class T>
auto owner(std::vector<std::unique_ptr<T>>& all, const T* one) {
    // many go one by one, the last first
    if (!all.empty() && all.back().get() == one) return all.end() - 1;
    return std::find_if(all.begin(), all.end(),
                        [&](const auto& candidate) { return candidate.get() == one; });
}

/// Makes a pin that a thread or function declares by itself. `memory` must outlive it.
inline std::unique_ptr<Pin> own_pin(Model& model, std::string name, hal_type type, hal_dir dir,
                                    hal_pin& memory, const char* doc, const char* unit) {
    auto pin = std::make_unique<Pin>();
    pin->name = std::move(name);
    pin->type = type;
    pin->dir = dir;
    pin->doc = doc;
    pin->unit = unit;
    pin->memory = &memory;
    pin->id = model.next_id++;
    memory.slot = &memory.own;
    return pin;
}

}  // namespace hal
