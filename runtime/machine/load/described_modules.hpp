// SPDX-License-Identifier: MIT
// What modules of LinuxCNC have, for `hal check`, which does not run them.
#pragma once

#include <string_view>

#include "hal/abi.h"

namespace hal {

/// Returns a component that declares the pins, parameters, functions and threads of a module of
/// LinuxCNC by its load arguments, and does nothing; nullptr when they are unknown. [setup]
const hal_component* description_of(std::string_view module) noexcept;

}  // namespace hal
