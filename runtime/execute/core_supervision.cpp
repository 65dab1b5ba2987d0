// SPDX-License-Identifier: MIT
// How a thread that does not finish its cycle is noticed, in which function it is, and what stands
// in for it.
#include <algorithm>
#include <functional>
#include <limits>

#include <sys/resource.h>

#include "execute/core.hpp"

namespace hal {
namespace {

// The function that a step of the plan belongs to; 0: none.
std::uint32_t function_of(const plan::Plan* plan, const plan::Step* step) noexcept {
    if (!plan || !step) return 0;
    const auto among = [step](const std::vector<plan::Step>& steps,
                              const std::vector<plan::Function>& functions) -> std::uint32_t {
        const std::less<> before;
        if (before(step, steps.data()) || !before(step, steps.data() + steps.size())) return 0;
        const auto at = static_cast<std::uint32_t>(step - steps.data());
        for (const plan::Function& function : functions) {
            if (at >= function.begin && at < function.end) return function.id;
        }
        return 0;
    };
    const std::uint32_t cyclic = among(plan->steps, plan->functions);
    return cyclic != 0 ? cyclic : among(plan->init_steps, plan->init);
}

}  // namespace

void Core::begin(std::int64_t now_ns, std::int64_t due_ns) noexcept {
    finished_.store(now_ns, std::memory_order_release);
    due_.store(due_ns - period_ns_, std::memory_order_release);
}

void Core::expect(std::int64_t now_ns) noexcept {
    std::int64_t never = 0;
    finished_.compare_exchange_strong(never, now_ns, std::memory_order_acq_rel);
    never = 0;
    due_.compare_exchange_strong(never, now_ns, std::memory_order_acq_rel);
}

void Core::woke_late(std::int64_t due_ns, std::int64_t now_ns) noexcept {
    const std::int64_t limit = supervise_ns.load(std::memory_order_relaxed);
    // then an excuse is a part of the gap
    const bool tolerant = max_gap_ns.load(std::memory_order_relaxed) > 0;
    const std::int64_t excused = tolerant ? 0 : excused_.load(std::memory_order_acquire);
    const std::int64_t silent_ns = now_ns - std::max({due_ns, finished_ns(), excused});
    if (limit == 0 || silent_ns <= limit) return;
    if (tolerate_gap(silent_ns) || !declare_hung()) return;
    raise({HAL_FAULT_SILENT_THREAD, 0, info_.number, info_.start_ns, static_cast<double>(silent_ns),
           nullptr, nullptr});
}

// The thread was ready, or its cycle was under way, while others had the CPU.
bool Core::tolerate_gap(std::int64_t silent_ns) noexcept {
    if (silent_ns > max_gap_ns.load(std::memory_order_relaxed)) return false;
    newest_gap_ns.store(silent_ns, std::memory_order_relaxed);
    gaps.store(gaps.load(std::memory_order_relaxed) + 1, std::memory_order_release);
    return true;
}

namespace {

struct Usage {
    std::int64_t cpu_ns, waits;
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

void Core::note_usage() noexcept {
    const Usage usage = usage_of_this_thread();
    cpu_before_ns_ = usage.cpu_ns;
    waits_before_ = usage.waits;
}

// The cycle took longer than the limit, but neither by computing nor by waiting in the kernel.
bool Core::was_preempted() const noexcept {
    const Usage usage = usage_of_this_thread();
    return usage.waits == waits_before_ &&
           usage.cpu_ns - cpu_before_ns_ < supervise_ns.load(std::memory_order_relaxed) / 2;
}

bool Core::declare_hung() noexcept {
    const std::uint64_t next = cycles.load(std::memory_order_acquire) + 1;
    if (hung_at_.exchange(next, std::memory_order_acq_rel) == next) return false;
    hangs.fetch_add(1, std::memory_order_relaxed);
    board_.begin(this, &stopped_);
    stopped_.store(true, std::memory_order_release);
    return true;
}

// A function writes the mark as an ordinary variable, millions of times a second; here one look at
// it is enough.
__attribute__((no_sanitize("thread"))) const plan::Step* Core::where() const noexcept {
    return mark_->current;
}

std::int64_t Core::overdue_since_ns() const noexcept {
    const std::int64_t busy_since = busy_since_ns();
    const std::int64_t due = due_.load(std::memory_order_acquire);
    if (due == 0 && busy_since == 0) return std::numeric_limits<std::int64_t>::max();
    const std::int64_t since =
        busy_since != 0 ? busy_since : std::max(finished_ns(), due + period_ns_);
    return std::max(since, excused_.load(std::memory_order_acquire));
}

void Core::sample() noexcept {
    const std::int64_t since = busy_since_.load(std::memory_order_acquire);
    if (since == 0 || !in_function()) return;
    const plan::Step* const step = where();
    if (busy_since_.load(std::memory_order_acquire) != since) return;
    seen_step_.store(step, std::memory_order_relaxed);
    seen_since_.store(since, std::memory_order_release);
}

void Core::stand_in(std::int64_t now_ns, bool emergency) noexcept {
    int free = nobody;
    const bool mine = turn_.compare_exchange_strong(free, supervisor, std::memory_order_acq_rel);
    if (plan::Plan* const plan = shown_.load(std::memory_order_acquire)) {
        for (const plan::Safe& safe : plan->safe) {
            __atomic_store_n(&safe.pin->slot->raw, safe.value.raw, __ATOMIC_RELAXED);
        }
        __atomic_store_n(&pins_.missed->slot->u32, static_cast<std::uint32_t>(missed_by(now_ns)),
                         __ATOMIC_RELAXED);
        if (emergency) {
            hal_cycle info{};
            info.size = sizeof info;
            info.period_ns = period_ns_;
            info.period_s = static_cast<double>(period_ns_) * 1e-9;
            info.start_ns = now_ns;
            info.number = cycles.load(std::memory_order_relaxed);
            for (const plan::Step& step : plan->emergency) {
                step.step(step.self, &info);
            }
        }
        if (mine) {
            publish(*plan);
        }
    }
    if (mine) {
        turn_.store(nobody, std::memory_order_release);
    }
}

std::uint64_t Core::missed_by(std::int64_t now_ns) const noexcept {
    const std::uint64_t counted = missed.load(std::memory_order_acquire);
    const std::int64_t due = due_.load(std::memory_order_acquire);

    const std::int64_t late = due == 0 ? 0 : (now_ns - due) / period_ns_ - 1;
    return counted + (late > 0 ? static_cast<std::uint64_t>(late) : 0);
}

std::uint32_t Core::current_function() const noexcept { return function_of(plan_, mark_->current); }

std::uint32_t Core::interrupted_function() const noexcept {
    return in_function() ? function_of(shown_.load(std::memory_order_acquire), where()) : 0;
}

std::uint32_t Core::hung_function() const noexcept {
    return busy_since_ns() != 0 ? interrupted_function() : 0;
}

// Where the newest sample of the cycle that woke at `woke_ns` found it; 0: that cycle has no
// sample.
std::uint32_t Core::slow_function(std::int64_t woke_ns) const noexcept {
    if (seen_since_.load(std::memory_order_acquire) != woke_ns) return 0;
    return function_of(plan_, seen_step_.load(std::memory_order_relaxed));
}

}  // namespace hal
