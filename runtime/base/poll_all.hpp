// SPDX-License-Identifier: MIT
#pragma once

#include <poll.h>
#include <span>

struct timespec;

namespace hal {

/// Waits as ppoll() does, without a change of the signal mask, also when the process may have fewer
/// descriptors (RLIMIT_NOFILE) than there are entries: then ppoll() fails with EINVAL at once, and
/// its caller would neither wait nor see anything. Without a timeout it waits until something
/// happens. Returns as ppoll() does; with too low a limit, only POLLIN and POLLOUT are reported (an
/// end as POLLIN), and descriptors from 1024 on are not looked at. [setup]
int poll_all(std::span<pollfd> entries, const timespec* timeout) noexcept;

}  // namespace hal
