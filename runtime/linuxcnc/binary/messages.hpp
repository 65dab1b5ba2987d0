// SPDX-License-Identifier: MIT
// What modules print. While a module is loaded or unloaded it is collected; in a cycle it goes
// through a bounded queue to a thread that prints it, at most `max_per_second` lines; otherwise it
// is printed at once.
#pragma once

#include <string>

namespace hal::modules {

constexpr unsigned max_per_second = 100;

/// Collects what the calling thread's module prints from now on. [setup]
void begin_capture() noexcept;
/// Returns the first message of level error that was collected; without one, everything. [setup]
std::string captured_cause();
/// Ends collecting and drops it. [setup]
void end_capture() noexcept;
/// Ends collecting and prints it. [setup]
void print_captured() noexcept;
/// Starts the thread that prints what is queued in cycles, unless it runs. [setup]
void start_printer() noexcept;
/// Prints what is queued and ends the thread. [setup]
void stop_printer() noexcept;

}  // namespace hal::modules
