// SPDX-License-Identifier: MIT
// Shared memory by key, for modules and for LinuxCNC's programs. The functions are in
// rtapi_interface.hpp.
#pragma once

namespace hal::modules {

/// True in a function that a real-time thread runs: nothing may be declared, allocated or printed
/// directly.
extern constinit thread_local bool in_cycle __attribute__((tls_model("initial-exec")));

/// True in the process whose threads run modules, false in a program.
extern const bool runs_modules;

/// Calls `action` for each segment that a component id holds.
void each_segment(int comp, void (*action)(void* self, const void* begin, unsigned long bytes),
                  void* self);
/// Detaches the segments that a component id holds.
void release_segments(int comp) noexcept;

}  // namespace hal::modules
