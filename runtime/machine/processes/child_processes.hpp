// SPDX-License-Identifier: MIT
// The child processes of a session: starts them, and notices their ends in a thread of its own.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <sys/types.h>

#include "machine/processes/spawner.hpp"

namespace hal {

class RunningModel;

/// Called by the thread of ChildProcesses with the session's lock held.
class ChildEvents {
public:
    /// When act_in_time() is due, on the steady clock; INT64_MAX: nothing is.
    virtual std::int64_t next_due_ns() const = 0;
    /// `status`: the exit status, or 128 + signal.
    virtual void child_ended(pid_t pid, int status) = 0;
    /// `overslept_ns`: latency of the wake-up.
    virtual void act_in_time(std::int64_t overslept_ns) = 0;
    /// The last call of each turn.
    virtual void notify() = 0;

protected:
    ~ChildEvents() = default;
};

/// All members except join() need the session's lock. [setup]
class ChildProcesses {
public:
    ChildProcesses(RunningModel& machine, ChildEvents& events)
        : machine_(machine), events_(events) {}
    ~ChildProcesses();  ///< after join()
    ChildProcesses(const ChildProcesses&) = delete;

    /// Starts a program. Returns its process ID, or 0 with the reason in `problem`.
    pid_t start(const ProcessStart& start, std::string& problem);
    /// Makes the thread ask for the next due time again.
    void wake();
    /// The thread ends after its current turn.
    void request_end();
    /// Waits for the thread's end, without the lock.
    void join();

private:
    struct Watched {
        pid_t pid;
        int pidfd;
    };

    void run();
    void collect_ended();
    int sleep_ms() const;

    RunningModel& machine_;
    ChildEvents& events_;
    std::unique_ptr<Spawner> spawner_;
    std::vector<Watched> watched_;
    int wake_ = -1;  // eventfd
    bool ending_ = false;
    std::thread reaper_;  // sleeps in poll() on wake_ and the pidfds, and until something is due
};

}  // namespace hal
