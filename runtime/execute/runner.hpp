// SPDX-License-Identifier: MIT
// One core on a thread of its own, which sleeps and spins to its deadlines; under the virtual clock
// without a thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>

#include <csignal>
#include <pthread.h>

#include "execute/core.hpp"
#include "execute/wait.hpp"

namespace hal {

struct CoreOptions {
    std::int64_t period_ns = 0;
    int cpu = -1;  ///< -1: an isolated CPU if there is one, else the last
    int priority = 0;  ///< SCHED_FIFO priority; 0: not a real-time policy
    bool deadline = false;  ///< SCHED_DEADLINE with runtime `budget` (or half the period)
    std::int64_t spin_ns = -1;
    std::int64_t budget_ns = 0;
    std::int64_t supervise_ns = 0;  ///< longest time without a finished cycle; 0: not supervised
    bool profile_every = false;
    /// Core::max_gap_ns, the second with a real-time policy
    std::int64_t max_gap_ns = 0;
    std::int64_t max_gap_realtime_ns = 0;
    std::string name{};  ///< as the system shows it: top -H, a debugger; its first 15 bytes
    CycleMark* mark = nullptr;  ///< nullptr: one of the thread's own
    CycleInputs* inputs = nullptr;  ///< records its cycles, or has those to be executed again
};

/// What the system granted a thread.
struct Granted {
    enum class Policy { fifo, deadline, other } policy = Policy::other;
    int priority = 0;
    int cpu = -1;
    bool refused = false;  ///< a real-time policy was requested and denied
};

class Runner {
public:
    /// `epoch_ns`: time of position 0 of the grid; `measure`: cycles take real time.
    Runner(std::uint32_t id, const CoreOptions& options, ThreadPins pins, FaultBoard& board,
           Timeline& timeline, const std::atomic<bool>& running, bool measure,
           std::int64_t epoch_ns);
    Runner(const Runner&) = delete;

    /// Starts the thread and waits until it has what the system grants it. Throws
    /// std::runtime_error when the system cannot create a thread.
    void start();
    bool started() const { return thread != pthread_t{}; }
    /// Asks the thread to end, and wakes it.
    void ask_to_end();
    /// Withdraws the request: the thread continues should its function return.
    void ask_to_go_on() { quit_.store(false, std::memory_order_release); }
    bool ended() const { return ended_.load(std::memory_order_acquire); }
    /// Waits for the end of a thread that has finished its last cycle. Returns false if it still
    /// runs.
    bool join(std::int64_t timeout_ns);
    /// Wakes the thread before its next cycle where possible.
    void call();

    /// Advances to the first position that is due after `now_ns`. Called by the thread itself.
    void place(std::int64_t now_ns) noexcept;
    /// Returns the number of page faults in the thread's cycles since its 100th.
    std::uint64_t page_faults() const;
    std::int64_t spin_ns() const { return wait_.spin_ns; }

    Core core;
    const CoreOptions options;
    pthread_t thread{};
    std::atomic<int> tid{0};
    Granted granted;  ///< what the system granted the thread
    /// position of the next cycle; the thread's, or the virtual clock's
    std::int64_t grid_ns = 0;

private:
    bool callable() const { return options.period_ns >= Wait::callable_period_ns; }
    void set_up() noexcept;
    void bind() noexcept;
    std::int64_t safe_until(std::int64_t due) const noexcept;
    bool sleep() noexcept;
    struct Woken {
        std::int64_t due_ns, now_ns;
    };
    Woken spin() const noexcept;
    void loop() noexcept;

    const Timeline& timeline_;
    const std::int64_t epoch_ns_;
    Wait wait_;
    std::atomic<bool> quit_{false};
    std::atomic<bool> ended_{false};
    std::atomic<bool> ready_{false};
    std::atomic<std::uint32_t> bell_{0};  // futex of slow threads
    std::atomic<std::uint64_t> faults_before_{0};
    std::unique_ptr<char[]> signal_stack_;
    stack_t signal_stack_before_{};  // a sanitizer's; it looks for it when the thread ends
};

}  // namespace hal
