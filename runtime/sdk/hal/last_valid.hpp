// SPDX-License-Identifier: MIT
// Pins whose value is used only while it is valid. Limits have a class of their own: limit.hpp.
#pragma once

#include <cmath>
#include <limits>
#include <string>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace hal {

/// Which values are valid, and what a fault states about the others.
struct ValueRule {
    bool (*accepts)(double) noexcept;
    const char* fault;
};

inline constexpr ValueRule finite_value{[](double value) noexcept { return std::isfinite(value); },
                                        " is NaN or infinite; "};
/// The newest valid value of a pin. While the value is invalid it applies, the default before a
/// cycle has had a valid one, and a fault is raised once.
class LastValid {
public:
    /// Begins with `initial`, or with 1 where a device has an invalid one.
    LastValid(Component& component, const char* name, const ValueRule& rule, double initial)
        : rule_(rule),
          valid_(rule.accepts(initial) ? initial : 1.0),
          self_(&component),
          fault_(name + std::string(rule.fault) + "its last valid value applies"),
          first_fault_(name + std::string(rule.fault) +
                       "its default applies, because no cycle has had a valid value"),
          faults_(extension<hal_faults>("hal.faults/1")),
          retained_(component, {{name, valid_},
                                {name, is_reported_},
                                {(std::string(name) + " is known").c_str(), is_known_}}) {}

    /// Returns `value`, or what applies in its place. [realtime]
    double follow(double value) noexcept {
        if (!rule_.accepts(value)) [[unlikely]] {
            report();
            return valid_;
        }
        valid_ = value;
        is_known_ = true;
        is_reported_ = false;
        return value;
    }

private:
    void report() noexcept {
        if (!is_reported_ && faults_ != nullptr) {
            const std::string& fault = is_known_ ? fault_ : first_fault_;
            faults_->raise(faults_, self_, fault.c_str(), std::numeric_limits<double>::quiet_NaN());
        }
        is_reported_ = true;
    }

    const ValueRule rule_;
    double valid_;
    bool is_known_ = false;  // `valid_` is a value of a cycle
    bool is_reported_ = false;
    const Component* self_;
    const std::string fault_, first_fault_;
    const hal_faults* faults_;
    [[no_unique_address]] Retained retained_;
};

}  // namespace hal
