// SPDX-License-Identifier: MIT
// The process at the other end of a socket. Internal to the server.
#pragma once

#include <cstdint>

#include <sys/types.h>

namespace hal {

/// Returns the time since the system was booted, in ns, also while it was suspended. [any]
std::int64_t boot_ns();
/// Returns when a process was started, in ns since the system was booted, rounded down to the clock
/// tick of the system (10 ms); -1 when there is no such process. [any]
std::int64_t process_start_ns(pid_t pid);
/// Opens a pidfd of the process `pid` that connected to a socket, which was accepted at
/// `accepted_ns` (boot_ns()). Returns -1 with errno: ESRCH when that process has ended, also when
/// its PID belongs to another process by now. [any]
int pidfd_of_peer(int fd, pid_t pid, std::int64_t accepted_ns);
/// Does the same on a kernel before Linux 6.5, which has no SO_PEERPIDFD. [any]
int pidfd_by_pid(pid_t pid, std::int64_t accepted_ns);

}  // namespace hal
