// SPDX-License-Identifier: MIT
// All cores of the process, where a signal handler can reach them.
#pragma once

namespace hal {

class Core;

/// Enters a core. Beyond 256 of them nothing is entered, and a crash handler does not know the core. [setup]
void list_core(Core& core) noexcept;
/// Removes a core, before it is destroyed. [setup]
void unlist_core(const Core& core);
/// Returns a core in the middle of a function; nullptr: there is none. [any]
Core* core_in_cycle() noexcept;
/// Calls make_safe() of all cores. async-signal-safe.
void make_all_safe() noexcept;

}  // namespace hal
