// SPDX-License-Identifier: MIT
// The argument `floor=FILE` of simulated robots and sensors.
#pragma once

#include <string>

#include "hal/texts.hpp"
#include "mobile/texts/floor_plan.hpp"

namespace hal::mobile {

/// Reads the floor plan `file`; without a file the floor is empty. In the constructor of a
/// component. [setup]
inline FloorPlan floor_from(hal::Component& component, const std::string& file) {
    FloorPlan floor;
    if (file.empty()) return floor;
    const hal::Texts texts(component);
    const std::string text = texts.read("floor", file);
    floor.read(text);
    texts.reject(file, text, "mobile-text", floor.problems);
    return floor;
}

}  // namespace hal::mobile
