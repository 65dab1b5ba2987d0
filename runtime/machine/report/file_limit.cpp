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

std::string lowered_text(rlim_t from, rlim_t to) {
    return "hal: the limit of open files was lowered from " + std::to_string(from) + " to " +
           std::to_string(to) + " by a component or another process";
}

}  // namespace

FileLimit::FileLimit() : begun_(limit_of_files()) {}

std::optional<std::string> FileLimit::restore(std::int64_t now_ns) {
    const rlimit now = limit_of_files();
    if (now.rlim_cur >= begun_.rlim_cur) {
        failure_reported_ = false;
        return due_line(now_ns);
    }
    // the hard limit can be raised with the capability CAP_SYS_RESOURCE only
    if (setrlimit(RLIMIT_NOFILE, &begun_) != 0) return not_raised(now);
    ++times_;
    lowered_to_ = now.rlim_cur;
    return due_line(now_ns);
}

/// Returns the line about the times since the last one, once its minute is over.
std::optional<std::string> FileLimit::due_line(std::int64_t now_ns) {
    if (times_ == 0 || now_ns - printed_ns_ < interval_ns) return std::nullopt;
    std::string text = lowered_text(begun_.rlim_cur, lowered_to_);
    if (times_ > 1) {
        text += ", " + std::to_string(times_) + " times";
    }
    times_ = 0;
    printed_ns_ = now_ns;
    return text + "; it was raised again\n";
}

std::optional<std::string> FileLimit::not_raised(const rlimit& lowered) {
    const rlimit all{lowered.rlim_max, lowered.rlim_max};
    if (lowered.rlim_cur < lowered.rlim_max) {
        setrlimit(RLIMIT_NOFILE, &all);
    }
    if (failure_reported_) return std::nullopt;
    failure_reported_ = true;
    return lowered_text(begun_.rlim_cur, lowered.rlim_cur) + ", and cannot be raised beyond " +
           std::to_string(limit_of_files().rlim_cur) +
           ": a client for which no file is left cannot connect; SIGTERM ends the machine; to "
           "raise "
           "it, type as root: prlimit --nofile=" +
           std::to_string(begun_.rlim_cur) + " --pid " + std::to_string(getpid()) + "\n";
}

}  // namespace hal
