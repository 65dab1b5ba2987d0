// SPDX-License-Identifier: MIT
// The factor between the units of a user and those of the card.
#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace hal::mesa {

/// A scale. While its value is 0, NaN, infinite or absurd, the last valid one of a cycle applies, its
/// default before there is one, and a fault is raised once: another factor would stop a motor at
/// once, or move its position.
class ScaleParam : public hal::Param<double> {
public:
    ScaleParam(hal::Component& component, const char* name, const char* doc,
               hal::PinOptions<double> options = {.initial = 1.0})
        : Param(component, name, doc, options),
          valid_(is_valid(options.initial) ? options.initial : 1.0),
          self_(&component),
          fault_(invalid(name) + "its last valid value applies"),
          first_fault_(invalid(name) +
                       "its default applies, because no cycle has had a valid value"),
          faults_(hal::extension<hal_faults>("hal.faults/1")),
          retained_(component, {{name, valid_},
                                {name, is_reported_},
                                {(std::string(name) + " is known").c_str(), is_known_}}) {}

    /// Returns the scale, whose magnitude is within 1e-15 and 1e15. [realtime]
    double get() const noexcept {
        const double value = Param::get();
        if (!is_valid(value)) [[unlikely]]
            return last_valid();
        valid_ = value;
        is_known_ = true;
        is_reported_ = false;
        return value;
    }
    operator double() const noexcept { return get(); }

private:
    static bool is_valid(double value) noexcept {
        const double magnitude = std::abs(value);
        return magnitude >= 1e-15 && magnitude <= 1e15;  // NaN is not
    }
    static std::string invalid(const char* name) {
        return std::string(name) + " is 0, NaN, or not within 1e-15 and 1e15; ";
    }
    double last_valid() const noexcept {
        if (!is_reported_ && faults_ != nullptr) {
            const std::string& fault = is_known_ ? fault_ : first_fault_;
            faults_->raise(faults_, self_, fault.c_str(), std::numeric_limits<double>::quiet_NaN());
        }
        is_reported_ = true;
        return valid_;
    }

    mutable double valid_;
    mutable bool is_known_ = false;  // `valid_` is a value of a cycle
    mutable bool is_reported_ = false;
    const hal::Component* self_;
    const std::string fault_, first_fault_;
    const hal_faults* faults_;
    [[no_unique_address]] hal::Retained retained_;
};

}  // namespace hal::mesa
