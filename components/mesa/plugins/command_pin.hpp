// SPDX-License-Identifier: MIT
// A commanded value, which has to be a number.
#pragma once

#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "hal/lasting_fault.hpp"
#include "module_pins.hpp"

namespace hal::mesa {

/// A command. While it is NaN, infinite or too large, a fault lasts that states what happens
/// instead.
class CommandPin : public hal::In<double> {
public:
    /// `reaction`: what happens instead, "the step generator brakes".
    CommandPin(const PinOwner& o, const char* name, const char* doc, const char* reaction,
               hal::PinOptions<double> options = {})
        : In(o.component, o.write, name, doc, options),
          self_(&o.component),
          not_finite_(std::string(name) + " is NaN or infinite; " + reaction),
          too_large_(std::string(name) + " is too large; " + reaction),
          faults_(hal::extension<hal_faults>("hal.faults/1")) {}

    /// Returns the command; nothing while it is invalid. [realtime] write
    std::optional<double> valid(double max = std::numeric_limits<double>::max()) noexcept {
        const double value = get();
        if (std::abs(value) <= max) [[likely]] {
            ignore();
            return value;
        }
        if (!fault_.lasts()) {
            const std::string& reason = std::isfinite(value) ? too_large_ : not_finite_;
            fault_.begin(faults_, self_, reason.c_str());
        }
        return {};
    }
    /// The command has no effect in this cycle. [realtime] write
    void ignore() noexcept { fault_.end(faults_, self_); }

private:
    const hal::Component* self_;
    const std::string not_finite_, too_large_;
    const hal_faults* faults_;
    hal::LastingFault fault_;
};

}  // namespace hal::mesa
