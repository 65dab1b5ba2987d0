// SPDX-License-Identifier: MIT
// Tasks of modules, as other files see them. The functions are in rtapi_interface.hpp.
#pragma once

namespace hal::modules {

/// Prints which tasks have not called rtapi_wait() for ten periods and at least 100 ms, once for
/// each time.
void report_silent_tasks() noexcept;
/// Sets what is added to each period of the calling task. Returns false if the thread runs none.
/// [realtime]
bool correct_task(long ns) noexcept;

}  // namespace hal::modules
