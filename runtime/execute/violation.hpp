// SPDX-License-Identifier: MIT
// What a function changes in the process around it: the reasons of faults HAL_FAULT_VIOLATION,
// which are compared by their addresses.
#pragma once

namespace hal::violation {

/// FaultEvent::value: FloatModes::Difference.
inline constexpr char float_modes[] = "changed the floating-point modes";
inline constexpr char forked[] = "called fork()";
inline constexpr char ended_thread[] = "ended its thread";

}  // namespace hal::violation
