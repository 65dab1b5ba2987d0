// SPDX-License-Identifier: MIT
// Pins that limit something. A limit that becomes NaN keeps its last valid value: see
// docs/decisions/0035-a-limit-that-is-not-a-number-keeps-its-last-value.md.
#pragma once

#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>

#include "hal/component.hpp"
#include "hal/corrected.hpp"
#include "hal/retained.hpp"

namespace hal {

/// What a limit of 0 means.
enum class ZeroLimit { lets_nothing_pass, disables };

/// A pin with a limit. While its value is NaN, the last value that was a number applies, and a
/// fault is raised once, whose text states what applies. Before the first number the default
/// applies if it is a limit, else nothing passes. One function of an instance reads it.
template <class P, ZeroLimit zero = ZeroLimit::lets_nothing_pass>
class LimitPin : public P {
public:
    LimitPin(Component& component, const char* name, const char* doc,
             PinOptions<double> options = {})
        : P(component, name, doc, options),
          valid_(first_limit(options.initial)),
          applies_(is_limit(options.initial) ? Applies::initial_value : Applies::nothing),
          self_(&component),
          faults_(fault_record()),
          retained_(component, {{name, valid_}, {name, applies_}, {name, reported_}}) {}
    LimitPin(Component& component, const Function& function, const char* name, const char* doc,
             PinOptions<double> options = {})
        : P(component, function, name, doc, options),
          valid_(first_limit(options.initial)),
          applies_(is_limit(options.initial) ? Applies::initial_value : Applies::nothing),
          self_(&component),
          faults_(fault_record()),
          retained_(component, {{name, valid_}, {name, applies_}, {name, reported_}}) {}
    LimitPin& operator=(double value) noexcept
        requires std::derived_from<P, Io<double>>
    {
        this->put(value);
        return *this;
    }

    /// Returns the limit, which is never NaN. [realtime]
    double get() const noexcept {
        const double value = P::get();
        if (std::isnan(value)) [[unlikely]]
            return last_valid();
        valid_ = value;
        applies_ = Applies::last_value;
        reported_ = false;
        return value;
    }
    operator double() const noexcept { return get(); }

private:
    /// Defaults beyond this mean that there is no limit.
    static constexpr double max_limit = 1e9;

    /// Where the value of `valid_` comes from.
    enum class Applies : std::uint8_t { last_value, initial_value, nothing };

    static bool is_limit(double initial) noexcept {
        return std::fabs(initial) < max_limit && !(zero == ZeroLimit::disables && initial == 0.0);
    }
    static double first_limit(double initial) noexcept {
        if (is_limit(initial)) return initial;
        return zero == ZeroLimit::disables ? std::numeric_limits<double>::denorm_min() : 0.0;
    }
    static const hal_faults* fault_record() { return extension<hal_faults>("hal.faults/1"); }

    static const char* reason(Applies applies) noexcept {
        switch (applies) {
        case Applies::initial_value:
            return "a limit is not a number and never was one; its default applies";
        case Applies::nothing: return nothing_applies();
        default: return "a limit is not a number; its last valid value applies";
        }
    }

    /// What applies before the first number; where 0 means that there is no limit, not that.
    static const char* nothing_applies() noexcept {
        if (zero == ZeroLimit::disables) {
            return "a limit is not a number and never was one; nothing passes";
        }
        return "a limit is not a number and never was one; 0 applies";
    }

    double last_valid() const noexcept {
        if (!reported_ && faults_ != nullptr) {
            faults_->raise(faults_, self_, reason(applies_),
                           std::numeric_limits<double>::quiet_NaN());
        }
        reported_ = true;
        return valid_;
    }

    mutable double valid_;
    mutable Applies applies_;
    mutable bool reported_ = false;
    const Component* self_;
    const hal_faults* faults_;
    [[no_unique_address]] Retained retained_;
};

using Limit = LimitPin<In<double>>;
using LimitParam = LimitPin<Param<double>>;
using CorrectedLimitParam = LimitPin<CorrectedParam<double>>;
using LimitIo = LimitPin<Io<double>>;
using Limits = Pins<Limit, double>;
using OptionalLimit = LimitPin<In<double>, ZeroLimit::disables>;
using OptionalLimitParam = LimitPin<Param<double>, ZeroLimit::disables>;
using OptionalCorrectedLimitParam = LimitPin<CorrectedParam<double>, ZeroLimit::disables>;
using OptionalLimits = Pins<OptionalLimit, double>;

}  // namespace hal
