// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace hal {

/// Limits the stacks of threads made later to a little less than 1 MB: locked memory is resident as
/// a whole, and glibc's default, the limit of the main thread, is usually 8 MB. A thread that sets
/// the size of its stack is not affected. [setup] before the first thread
void limit_helper_stacks();
/// Unlocks and frees this thread's stack except the bytes in use and `kept_bytes` below them. A
/// helper thread calls it first: where memory is locked, its whole stack would stay resident. Never
/// in a thread that runs cycles, which would fault when its stack grows. [setup]
void release_unused_stack(std::size_t kept_bytes = 1 << 16) noexcept;
/// Locks the memory of the process and keeps the CPU out of deep sleep states, once per process:
/// best before the first helper thread, whose released stack it would lock again. Returns what the
/// system denied: "memory locking". [setup]
const std::vector<std::string>& prepare_process();

}  // namespace hal
