// SPDX-License-Identifier: MIT
// What a function changes in the process around it: the reasons of faults HAL_FAULT_VIOLATION,
// which are compared by their addresses.
#pragma once

namespace hal::violation {

/// FaultEvent::value: FloatModes::Difference.
inline constexpr char float_modes[] = "changed the floating-point modes";
inline constexpr char forked[] = "called fork()";
inline constexpr char ended_thread[] = "ended its thread";
/// Only while `hal check --deterministic` simulates.
inline constexpr char read_outside[] = "reads a socket or a file that no journal has";

}  // namespace hal::violation
