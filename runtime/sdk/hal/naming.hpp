// SPDX-License-Identifier: MIT
// For components whose instance or function names in LinuxCNC differ from COMPONENT.N.
#pragma once

#include <string>

#include "hal/component.hpp"
#include "hal/naming.h"

namespace hal {

/// Returns the name of the instance under construction; `otherwise` if the host does not provide
/// it. In a constructor only. [setup]
inline std::string own_name(const char* otherwise) {
    const auto* naming = extension<hal_naming>(HAL_NAMING);
    return naming != nullptr ? naming->name(detail::creating) : otherwise;
}

/// Names the instance PREFIX.N instead of COMPONENT.N, N with at least `digits` digits. A member
/// before all pins.
class InstanceName {
public:
    InstanceName(Component&, const char* prefix, unsigned digits = 1) {
        if (const auto* naming = extension<hal_naming>(HAL_NAMING)) {
            naming->instance(detail::creating, prefix, digits);
        }
    }
};

/// Declares that the names of all further functions are complete, without the name of the component
/// or instance.
class WholeFunctionNames {
public:
    explicit WholeFunctionNames(Component&) {
        if (const auto* naming = extension<hal_naming>(HAL_NAMING)) {
            naming->whole_function_names(detail::creating);
        }
    }
};

/// Makes an argument the number of instances: `loadrt modmath mod_dir=2`.
class InstanceCount {
public:
    InstanceCount(Component& component, const char* name, std::int64_t fallback, const char* doc)
        : count_(component, name, fallback, doc, {.min = 1, .max = 10'000'000}) {
        if (const auto* naming = extension<hal_naming>(HAL_NAMING)) {
            naming->count(detail::creating, name, static_cast<std::uint64_t>(count_));
        }
    }

private:
    Argument count_;
};

}  // namespace hal
