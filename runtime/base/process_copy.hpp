// SPDX-License-Identifier: MIT
#pragma once

#include <atomic>

namespace hal {

/// TRUE in a child process that fork() has made of a machine's, for as long as it runs no other
/// program. Such a process must neither drive outputs nor serve clients. Written behind fork() in
/// the child, which has one thread then.
inline std::atomic<bool> in_process_copy{false};

}  // namespace hal
