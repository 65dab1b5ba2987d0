// SPDX-License-Identifier: MIT
#include "machine/report/cycle_guard.hpp"

#include <algorithm>
#include <chrono>
#include <string>

#include <unistd.h>

#include "base/types.hpp"
#include "execute/crash_table.hpp"
#include "execute/process_setup.hpp"
#include "execute/virtual_clock.hpp"
#include "machine/report/crash.hpp"

namespace hal {

CycleTimeLimit::Action CycleTimeLimit::check(const CycleNow& now, std::int64_t now_ns) noexcept {
    if (now.core != seen_.core || now.cycle != seen_.cycle) {
        cycle_since_ns_ = function_since_ns_ = now_ns;
        slow_ = false;
    } else if (now.function != seen_.function) {
        function_since_ns_ = now_ns;
    }
    seen_ = now;
    if (!now.core) return Action::none;
    const std::int64_t took = cycle_ns(now_ns);
    if (limit_ns > 0 && took >= limit_ns) return Action::end;
    if (took < first_report_ns) return Action::none;
    if (!slow_) {
        slow_ = true;
        ++slow_cycles_;
    }
    if (reported_ns_ != 0) {
        if (now_ns - reported_ns_ < pause_ns_) return Action::none;
        pause_ns_ = std::min(2 * pause_ns_, max_pause_ns);
    }
    reported_ns_ = now_ns;
    return Action::report;
}

CycleGuard::~CycleGuard() {
    if (!thread_.joinable()) return;
    {
        const std::lock_guard lock(mutex_);
        over_ = true;
    }
    wake_.notify_all();
    thread_.join();
}

namespace {

/// Of a cycle that has ended, too late: most are shorter than the interval in which the guard
/// looks.
void end_after_slow_cycle(const Core& core, std::int64_t took_ns) {
    const CycleNames names = names_of(CycleNow{&core, 0, 0});
    make_all_safe();
    const std::string text =
        "hal: " + names.thread + ": the cycle took " +
        format_duration(static_cast<double>(took_ns)) + " of wall time (--cycle-limit " +
        format_duration(static_cast<double>(VirtualClock::cycle_limit.limit_ns)) + ", cycle " +
        std::to_string(core.monitor.cycles() - 1) +
        "); outputs were set to their safe values; the process ends [hung-thread]\n";
    [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text.data(), text.size());
    end_process(1);
}

}  // namespace

void CycleGuard::begin(std::int64_t limit_ns) {
    VirtualClock::cycle_limit = {limit_ns, end_after_slow_cycle};
    time_limit_.limit_ns = limit_ns;
    thread_ = std::thread([this] { work(); });
}

void CycleGuard::end_soon() {
    const std::lock_guard lock(mutex_);
    const std::int64_t limit =
        ending_limit_ns + (time_limit_.in_cycle() ? time_limit_.cycle_ns(monotonic_ns()) : 0);
    if (time_limit_.limit_ns == 0 || time_limit_.limit_ns > limit) {
        time_limit_.limit_ns = limit;
    }
}

namespace {

std::string wall_time(std::int64_t ns) {
    return format_duration(static_cast<double>(ns / 100'000'000 * 100'000'000));
}

}  // namespace

/// The guard's thread. Prints which thread, function and cycle take too long, and ends the process
/// with safe outputs when the limit of the user is exceeded.
void CycleGuard::work() {
    release_unused_stack();
    std::unique_lock lock(mutex_);
    while (!over_) {
        const std::int64_t interval =
            time_limit_.limit_ns > 0
                ? std::clamp<std::int64_t>(time_limit_.limit_ns / 8, 1'000'000, 100'000'000)
                : 100'000'000;
        if (wake_.wait_for(lock, std::chrono::nanoseconds(interval), [this] { return over_; })) {
            return;
        }
        const CycleNow now = cycle_now();
        const std::int64_t now_ns = monotonic_ns();
        const CycleTimeLimit::Action action = time_limit_.check(now, now_ns);
        if (action == CycleTimeLimit::Action::none) continue;
        const CycleNames names = names_of(now);
        const bool end = action == CycleTimeLimit::Action::end;
        const std::int64_t took = time_limit_.cycle_ns(now_ns);
        std::string text = "hal: " + names.thread + ": ";
        if (!names.function.empty() && time_limit_.one_function()) {
            text += names.function + " has not returned for ";
        } else {
            text += "the cycle has not ended for ";
        }
        text += took < 1'000'000'000 ? format_duration(static_cast<double>(took)) : wall_time(took);
        text += " of wall time";
        if (!names.function.empty() && !time_limit_.one_function()) {
            text += ", now in " + names.function;
        }
        text += " (cycle " + std::to_string(now.cycle) + ")";
        if (end) {
            make_all_safe();
            text += "; outputs were set to their safe values; the process ends [hung-thread]\n";
        } else {
            if (time_limit_.slow_cycles() > 1) {
                text += "; " + std::to_string(time_limit_.slow_cycles()) +
                        " cycles took longer than " + wall_time(CycleTimeLimit::first_report_ns);
            }
            text += "; it goes on (--cycle-limit TIME ends it)\n";
        }
        [[maybe_unused]] const auto written = ::write(STDERR_FILENO, text.data(), text.size());
        if (end) {
            end_process(1);
        }
    }
}

}  // namespace hal
