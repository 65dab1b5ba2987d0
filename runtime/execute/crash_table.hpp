// SPDX-License-Identifier: MIT
// All cores of the process, where a signal handler can reach them.
#pragma once

namespace hal {

class Core;

/// Registers a core. Crash handlers cover at most 256 cores; further ones are not registered.
/// [setup]
void list_core(Core& core) noexcept;
/// Removes a core, before it is destroyed. [setup]
void unlist_core(const Core& core);
/// Returns a core that is running a function; nullptr: none. [any]
Core* core_in_cycle() noexcept;
/// Calls make_safe() of all cores. async-signal-safe.
void make_all_safe() noexcept;

}  // namespace hal
