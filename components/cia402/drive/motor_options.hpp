// SPDX-License-Identifier: MIT
// The parameters of a simulated motor by name, for load arguments and commands. Everything here is
// [setup].
#pragma once

#include <string>
#include <string_view>

#include "cia402/drive/axis_settings.hpp"

namespace hal::cia402 {

/// Sets a motor parameter by name, as in "inertia" and 1e-4. Returns false for an unknown name or
/// an impossible value.
bool set_motor(MotorSettings&, std::string_view name, double value);
/// Parses "inertia:1e-4,resolution:8192", or with semicolons where a comma has another meaning;
/// empty is valid. Returns the problem, or "".
std::string parse_motor(std::string_view text, MotorSettings&);

}  // namespace hal::cia402
