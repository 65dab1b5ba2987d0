// SPDX-License-Identifier: MIT
// Pins and parameters whose invalid values do not reach the card.
#pragma once

#include "hal/component.hpp"
#include "hal/last_valid.hpp"

namespace hal::mesa {

/// An infinite one is the longest.
inline constexpr ValueRule time_value{[](double value) noexcept { return value >= 0.0; },
                                      " is negative or NaN; "};

/// A pin or parameter of which invalid values have no effect.
template <class P>
class ValidPin : public P {
public:
    ValidPin(hal::Component& component, const char* name, const char* doc, const ValueRule& rule,
             hal::PinOptions<double> options)
        : P(component, name, doc, options), valid_(component, name, rule, options.initial) {}
    ValidPin(hal::Component& component, const hal::Function& function, const char* name,
             const char* doc, const ValueRule& rule, hal::PinOptions<double> options)
        : P(component, function, name, doc, options),
          valid_(component, name, rule, options.initial) {}

    /// Returns the value that applies. [realtime]
    double get() const noexcept { return valid_.follow(P::get()); }
    operator double() const noexcept { return get(); }

private:
    mutable LastValid valid_;
};

using ValidIn = ValidPin<hal::In<double>>;
using ValidParam = ValidPin<hal::Param<double>>;

}  // namespace hal::mesa
