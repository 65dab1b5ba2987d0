// SPDX-License-Identifier: MIT
// The limit of open files of this process. accept() fails when as many files are open: with a
// lowered limit no client can connect to a machine.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include <sys/resource.h>

namespace hal {

/// Raises the limit again when a component or another process (prlimit) has lowered it. Used by one
/// thread. [setup]
class FileLimit {
public:
    static constexpr std::int64_t interval_ns = 60'000'000'000;

    FileLimit();
    /// Returns the line to print about a limit that was lowered: at most one per minute while it
    /// can be raised again, with the number of times; one in all while it cannot be.
    std::optional<std::string> restore(std::int64_t now_ns);

private:
    std::optional<std::string> due_line(std::int64_t now_ns);
    std::optional<std::string> not_raised(const rlimit& lowered);

    const rlimit begun_;
    unsigned times_ = 0;  // since the last line
    rlim_t lowered_to_ = 0;  // the last time
    std::int64_t printed_ns_ = -interval_ns;
    bool failure_reported_ = false;
};

}  // namespace hal
