// SPDX-License-Identifier: MIT
// The limit of open files of this process. accept() fails when as many files are open: with a
// lowered limit no client can connect to a machine.
#pragma once

#include <optional>
#include <string>

#include <sys/resource.h>

namespace hal {

/// Raises the limit again when a component or another process (prlimit) has lowered it. Used by one
/// thread. [setup]
class FileLimit {
public:
    FileLimit();
    /// Returns the line to print about a limit that was lowered: one for each time that it could be
    /// raised again, one in all while it cannot be.
    std::optional<std::string> restore();

private:
    /// Returns the soft limit that was reached.
    std::optional<rlim_t> raise(const rlimit& now) const;

    const rlimit begun_;
    bool failure_reported_ = false;
};

}  // namespace hal
