// SPDX-License-Identifier: MIT
// The factor between the units of a user and those of the card.
#pragma once

#include <cmath>

#include "valid_pin.hpp"

namespace hal::mesa {

inline constexpr ValueRule scale_value{[](double value) noexcept {
    const double magnitude = std::abs(value);
    return magnitude >= 1e-15 && magnitude <= 1e15;  // NaN is not
}, " is 0, NaN, or not within 1e-15 and 1e15; "};

/// A scale, which may be negative: the other direction. While its value is 0, NaN, infinite or
/// absurd, the last valid one applies: another factor would stop a motor at once, or move its
/// position.
class ScaleParam : public ValidParam {
public:
    ScaleParam(hal::Component& component, const char* name, const char* doc,
               hal::PinOptions<double> options = {.initial = 1.0})
        : ValidPin(component, name, doc, scale_value, options) {}
};

}  // namespace hal::mesa
