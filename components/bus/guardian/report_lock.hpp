// SPDX-License-Identifier: MIT
#pragma once

#include <fcntl.h>
#include <sys/file.h>

#include <cerrno>
#include <cstdint>
#include <string>
#include <utility>

#include "link/system.hpp"

namespace hal::bus {

/// Returns the file whose lock a report has.
inline std::string lock_file(const std::string& report) { return report + ".lock"; }

/// One machine at a time has a report file: `REPORT.lock` beside it is locked for as long as the
/// machine or its guardian runs. The guardian inherits the descriptor, so that a machine that is
/// started again at once does not take a report that is not yet written.
class ReportLock {
public:
    /// Locks the report of a guardian of `link`, and waits for at most `limit_ns` for the guardian
    /// of a machine that has just ended. Returns the problem, or "". Locks nothing when the name is
    /// empty or the folder is not writable, because the guardian cannot write a report then. [setup]
    std::string acquire(const std::string& report, const std::string& link,
                        std::int64_t limit_ns = 2'000'000'000) {
        release();
        if (report.empty()) return {};
        link::Descriptor file(
            ::open(lock_file(report).c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600));
        const std::int64_t end = link::monotonic_ns() + limit_ns;
        while (file && flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
            if (errno != EWOULDBLOCK && errno != EINTR) return {};
            if (link::monotonic_ns() >= end) {
                return "another program uses '" + link +
                       "' with a guardian of this name, or such a guardian still sends its stop; "
                       "end that program, or load this one under another name";
            }
            const timespec pause = link::to_timespec(20'000'000);
            nanosleep(&pause, nullptr);
        }
        file_ = std::move(file);
        return {};
    }
    /// Returns the descriptor that holds the lock, or -1.
    int descriptor() const noexcept { return file_.get(); }
    /// Leaves the lock to the guardian, if it still runs. [setup]
    void release() noexcept { file_ = link::Descriptor(); }

private:
    link::Descriptor file_;
};

}  // namespace hal::bus
