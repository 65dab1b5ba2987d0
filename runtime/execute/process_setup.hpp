// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace hal {

/// Limits the stacks of threads made later to 1 MB: locked memory is resident as a whole, and
/// glibc's default, the limit of the main thread, is usually 8 MB. A thread that sets the size of
/// its stack is not affected. [setup] before the first thread
void limit_helper_stacks();
/// Locks the memory of the process and keeps the CPU out of deep sleep states, once per process.
/// Returns what the system denied: "memory locking". [setup]
std::vector<std::string> prepare_process();

}  // namespace hal
