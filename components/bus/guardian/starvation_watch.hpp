// SPDX-License-Identifier: MIT
// A guardian that gets no CPU time, because a real-time thread of the machine takes all of it.
//
// A guardian works below the threads of a machine, so that its telegrams do not delay their cycles.
// A thread that never sleeps would then keep it from its CPU, and keep the devices running. So a
// thread of the guardian, above all others, counts the turns of its loop: when there are none, the
// loop gets the highest priority as well, and loses it when it has made turns for some time.
#pragma once

#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>

#include "link/system.hpp"

namespace hal::bus {

/// The priority of a guardian whose loop gets CPU time.
inline constexpr int guardian_priority = 10;

/// Of the thread that makes it, for the rest of the process: it has no end. Without the permission
/// for real-time priorities it does nothing.
class StarvationWatch {
public:
    StarvationWatch() : loop_(static_cast<pid_t>(syscall(SYS_gettid))) {
        if (start(sched_get_priority_max(SCHED_FIFO))) return;
        rlimit limit{};
        if (getrlimit(RLIMIT_RTPRIO, &limit) != 0 || limit.rlim_cur <= guardian_priority) return;
        start(static_cast<int>(limit.rlim_cur));
    }
    StarvationWatch(const StarvationWatch&) = delete;

    /// Counts a turn of the loop. [realtime]
    void turn() noexcept { turns_.fetch_add(1, std::memory_order_relaxed); }

private:
    static constexpr std::size_t stack_bytes = 64 * 1024;
    static constexpr std::int64_t look_ns = 10'000'000;  // the loop makes a turn in 5 ms
    static constexpr int starved_looks = 2;
    static constexpr int calm_looks = 100;

    /// Returns whether the system grants this priority.
    bool start(int priority) {
        top_ = priority;
        pthread_attr_t attributes;
        pthread_attr_init(&attributes);
        pthread_attr_setstacksize(&attributes, stack_bytes);  // it is locked in memory
        pthread_attr_setdetachstate(&attributes, PTHREAD_CREATE_DETACHED);
        pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
        pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
        const sched_param parameters{.sched_priority = priority};
        pthread_attr_setschedparam(&attributes, &parameters);
        pthread_t thread{};
        const int failed = pthread_create(&thread, &attributes, [](void* self) -> void* {
            static_cast<StarvationWatch*>(self)->run();
            return nullptr;
        }, this);
        pthread_attr_destroy(&attributes);
        return failed == 0;
    }
    [[noreturn]] void run() noexcept {
        std::uint32_t seen = turns_.load(std::memory_order_relaxed);
        int looks = 0;  // in a row that contradict the priority of the loop
        bool is_raised = false;
        while (true) {
            const timespec pause = link::to_timespec(look_ns);
            nanosleep(&pause, nullptr);
            const std::uint32_t turns = turns_.load(std::memory_order_relaxed);
            const bool is_starved = turns == seen;
            seen = turns;
            looks = is_starved == is_raised ? 0 : looks + 1;
            if (looks < (is_raised ? calm_looks : starved_looks)) continue;
            looks = 0;
            is_raised = !is_raised;
            const sched_param priority{.sched_priority = is_raised ? top_ : guardian_priority};
            sched_setscheduler(loop_, SCHED_FIFO | SCHED_RESET_ON_FORK, &priority);
        }
    }

    const pid_t loop_;
    int top_ = 0;
    std::atomic<std::uint32_t> turns_{0};
};

}  // namespace hal::bus
