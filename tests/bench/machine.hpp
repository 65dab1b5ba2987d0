// SPDX-License-Identifier: MIT
// The machine the figures are taken on: what it is, how quiet it is, and a thread of our own that
// runs like the runtime's.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <pthread.h>
#include <string>
#include <vector>

namespace hal::bench {

/// The priority of every real-time thread of the bench and of its peers.
inline constexpr int priority = 98;

/// Returns lines that describe this machine: processor, kernel, real-time limits.
std::vector<std::string> machine_facts(int cpu);
/// The CPU for the real-time thread: the last isolated one, or the last of all; as the runtime
/// chooses.
int real_time_cpu();
/// Keeps this thread, and what it starts, off that CPU (if there is another).
void stay_off(int cpu);
/// Waits until other programs leave the processors alone: at most `max_s`.
void wait_for_quiet(double max_s);
/// Cycles of the time-stamp counter per ns; 0 where there is none.
double tsc_per_ns();
/// Time the hypervisor took from all CPUs since the machine started, ms. 0 on a real machine.
double stolen_ms();

/// Runs `work` once in a SCHED_FIFO thread on that CPU (in an ordinary thread where that is not
/// allowed) and waits for it.
void run_real_time(int cpu, const std::function<void()>& work);

/// Runs `work` in a thread that ordinary programs do not preempt (SCHED_FIFO 1, as are the programs
/// it starts; an ordinary thread where that is not allowed), waits for it, and passes on what it
/// throws. Other work on the machine does not count.
void run_undisturbed(const std::function<void()>& work);

/// A loop of one's own as a real-time program would write it: the same wait, priority and CPU as a
/// thread of the runtime, and its execution time where a sampler can see it.
class PeriodicThread {
public:
    PeriodicThread(int cpu, std::int64_t period_ns, std::function<void(std::uint64_t cycle)> work);
    ~PeriodicThread();
    PeriodicThread(const PeriodicThread&) = delete;
    std::int32_t last_ns() const { return last_ns_.load(std::memory_order_relaxed); }

private:
    const int cpu_;
    const std::int64_t period_ns_;
    const std::function<void(std::uint64_t)> work_;
    std::atomic<std::int32_t> last_ns_{0};  // written by the thread
    std::atomic<bool> quit_{false};
    pthread_t thread_{};
};

}  // namespace hal::bench
