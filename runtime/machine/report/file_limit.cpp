// SPDX-License-Identifier: MIT
#include "machine/report/file_limit.hpp"

#include <unistd.h>

namespace hal {
namespace {

rlimit limit_of_files() {
    rlimit limit{};
    getrlimit(RLIMIT_NOFILE, &limit);
    return limit;
}

}  // namespace

FileLimit::FileLimit() : begun_(limit_of_files()) {}

std::optional<rlim_t> FileLimit::raise(const rlimit& now) const {
    // the hard limit can be raised with the capability CAP_SYS_RESOURCE only
    const rlimit within_hard{now.rlim_max, now.rlim_max};
    for (const rlimit& wanted : {begun_, within_hard}) {
        if (wanted.rlim_cur > now.rlim_cur && setrlimit(RLIMIT_NOFILE, &wanted) == 0) {
            return wanted.rlim_cur;
        }
    }
    return std::nullopt;
}

std::optional<std::string> FileLimit::restore() {
    const rlimit now = limit_of_files();
    const bool is_lowered = now.rlim_cur < begun_.rlim_cur;
    if (!is_lowered) {
        failure_reported_ = false;
        return std::nullopt;
    }
    const std::string lowered = "hal: the limit of open files was lowered to " +
                                std::to_string(now.rlim_cur) +
                                " by a component or another process";
    if (const std::optional<rlim_t> raised = raise(now)) {
        return lowered + "; it is " + std::to_string(*raised) + " again\n";
    }
    if (failure_reported_) return std::nullopt;
    failure_reported_ = true;
    return lowered +
           ", and cannot be raised: further clients cannot connect; SIGTERM ends the machine; to "
           "raise it, type as root: prlimit --nofile=" +
           std::to_string(begun_.rlim_cur) + " --pid " + std::to_string(getpid()) + "\n";
}

}  // namespace hal
