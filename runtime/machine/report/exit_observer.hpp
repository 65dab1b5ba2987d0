// SPDX-License-Identifier: MIT
// A process that outlives the machine's for a moment: when the machine's process ends in a way that
// no handler inside sees (a system call exit_group of a component, SIGKILL), it names the functions
// that ran. Decision 34.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <sys/types.h>

#include "execute/cycle_mark.hpp"

namespace hal {

struct Thread;

class ExitObserver {
public:
    static constexpr std::size_t max_threads = 64;  ///< further threads are not named

    /// Forks the observer of the machine `name`: before the process has other threads. Without
    /// shared memory or a process there is none. [setup]
    explicit ExitObserver(const std::string& name);
    /// The machine has shut down: ends the observer without a message. [setup]
    ~ExitObserver();
    ExitObserver(const ExitObserver&) = delete;

    /// Returns the mark of a new thread; nullptr when all marks are used, or without an observer.
    /// [setup]
    CycleMark* take_mark();
    /// The thread has ended. [setup]
    void give_back(const CycleMark* mark);
    /// Names the functions of the plan that the thread runs from now on. [setup]
    void describe(const CycleMark* mark, const Thread& thread, const plan::Plan& plan) noexcept;

    /// The end of this process has been reported: the observer prints nothing. async-signal-safe
    static void silence() noexcept;

private:
    struct Shared;
    [[noreturn]] void observe(int parent, pid_t machine) const;
    void report(pid_t machine) const;

    Shared* shared_ = nullptr;  // in both processes
    int names_ = -1;  // memfd: what describe() wrote, max_text bytes per mark
    pid_t observer_ = -1;
    std::vector<bool> taken_ = std::vector<bool>(max_threads);
};

}  // namespace hal
