// SPDX-License-Identifier: MIT
#include "execute/cycle_monitor.hpp"

#include <algorithm>
#include <limits>

#include <sys/resource.h>

namespace hal {
namespace {

struct Usage {
    std::int64_t cpu_ns;
    std::int64_t waits;
};

Usage usage_of_this_thread() noexcept {
    const auto ns = [](const timeval& t) noexcept {
        return (std::int64_t{t.tv_sec} * 1'000'000 + t.tv_usec) * 1000;
    };
    rusage usage{};
    getrusage(RUSAGE_THREAD, &usage);
    return {ns(usage.ru_utime) + ns(usage.ru_stime), usage.ru_nvcsw};
}

}  // namespace

void CycleMonitor::begin(std::int64_t now_ns, std::int64_t due_ns) noexcept {
    finished_.store(now_ns, std::memory_order_release);
    due_.store(due_ns - period_ns_, std::memory_order_release);
}

void CycleMonitor::begin_cycle(std::int64_t due_ns, std::int64_t woke_ns) noexcept {
    due_.store(due_ns, std::memory_order_release);
    busy_since_.store(woke_ns, std::memory_order_release);
    if (is_tolerant()) {
        note_usage();
    }
}

void CycleMonitor::end_cycle(std::int64_t end_ns) noexcept {
    finished_.store(end_ns, std::memory_order_release);
    cycles_.store(cycles_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
    busy_since_.store(0, std::memory_order_release);
}

void CycleMonitor::skip(std::uint64_t periods) noexcept {
    // first the deadline, then the number: missed_by() never counts a period twice
    const std::int64_t due = due_.load(std::memory_order_relaxed);
    due_.store(due + static_cast<std::int64_t>(periods) * period_ns_, std::memory_order_release);
    missed_.store(missed_.load(std::memory_order_relaxed) + periods, std::memory_order_release);
}

std::int64_t CycleMonitor::silence_before(std::int64_t due_ns, std::int64_t now_ns) noexcept {
    const std::int64_t limit = supervise_ns.load(std::memory_order_relaxed);
    // with tolerated gaps an excuse is a part of the gap
    const std::int64_t excused = is_tolerant() ? 0 : excused_.load(std::memory_order_acquire);
    const std::int64_t silent_ns = now_ns - std::max({due_ns, finished_ns(), excused});
    if (limit == 0 || silent_ns <= limit) return 0;
    return tolerate_gap(silent_ns) ? 0 : silent_ns;
}

CycleMonitor::Length CycleMonitor::length(std::int64_t woke_ns, std::int64_t now_ns) noexcept {
    const std::int64_t limit = supervise_ns.load(std::memory_order_relaxed);
    const std::int64_t busy_ns = now_ns - woke_ns;
    if (limit == 0 || busy_ns <= limit) return Length::permitted;
    if (is_tolerant() && was_preempted() && tolerate_gap(busy_ns)) return Length::gap;
    const std::int64_t since = std::max(woke_ns, excused_.load(std::memory_order_acquire));
    return now_ns - since > limit ? Length::silent : Length::permitted;
}

/// Counts a gap: the thread was ready, or its cycle was under way, while others had the CPU.
bool CycleMonitor::tolerate_gap(std::int64_t silent_ns) noexcept {
    if (silent_ns > max_gap_ns.load(std::memory_order_relaxed)) return false;
    newest_gap_ns.store(silent_ns, std::memory_order_relaxed);
    gaps.store(gaps.load(std::memory_order_relaxed) + 1, std::memory_order_release);
    return true;
}

void CycleMonitor::note_usage() noexcept {
    const Usage usage = usage_of_this_thread();
    cpu_before_ns_ = usage.cpu_ns;
    waits_before_ = usage.waits;
}

/// The cycle took longer than the limit, but neither by computing nor by waiting in the kernel.
bool CycleMonitor::was_preempted() const noexcept {
    const Usage usage = usage_of_this_thread();
    return usage.waits == waits_before_ &&
           usage.cpu_ns - cpu_before_ns_ < supervise_ns.load(std::memory_order_relaxed) / 2;
}

const plan::Step* CycleMonitor::sampled_step(std::int64_t woke_ns) const noexcept {
    if (seen_since_.load(std::memory_order_acquire) != woke_ns) return nullptr;
    return seen_step_.load(std::memory_order_relaxed);
}

void CycleMonitor::expect(std::int64_t now_ns) noexcept {
    std::int64_t never = 0;
    finished_.compare_exchange_strong(never, now_ns, std::memory_order_acq_rel);
    never = 0;
    due_.compare_exchange_strong(never, now_ns, std::memory_order_acq_rel);
}

void CycleMonitor::sample(const CycleMark& mark) noexcept {
    const std::int64_t since = busy_since_ns();
    if (since == 0 || !mark.in_function.load(std::memory_order_relaxed)) return;
    const plan::Step* const step = newest_step(mark);
    if (busy_since_ns() != since) return;
    seen_step_.store(step, std::memory_order_relaxed);
    seen_since_.store(since, std::memory_order_release);
}

bool CycleMonitor::declare_hung() noexcept {
    const std::uint64_t next = cycles() + 1;
    if (hung_at_.exchange(next, std::memory_order_acq_rel) == next) return false;
    hangs_.fetch_add(1, std::memory_order_relaxed);
    return true;
}

std::int64_t CycleMonitor::overdue_since_ns() const noexcept {
    const std::int64_t busy_since = busy_since_ns();
    const std::int64_t due = due_.load(std::memory_order_acquire);
    if (due == 0 && busy_since == 0) return std::numeric_limits<std::int64_t>::max();
    const std::int64_t next = std::max(finished_ns(), due + period_ns_);
    const std::int64_t since = busy_since != 0 ? busy_since : next;
    return std::max(since, excused_.load(std::memory_order_acquire));
}

std::uint64_t CycleMonitor::missed_by(std::int64_t now_ns) const noexcept {
    const std::uint64_t counted = missed();
    const std::int64_t due = due_.load(std::memory_order_acquire);
    const std::int64_t late = due == 0 ? 0 : (now_ns - due) / period_ns_ - 1;
    return counted + (late > 0 ? static_cast<std::uint64_t>(late) : 0);
}

}  // namespace hal
