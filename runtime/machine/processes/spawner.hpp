// SPDX-License-Identifier: MIT
// Starts programs. Internal to the shell.
//
// The kernel sends a child its parent-death signal when the thread that made it ends, so all
// children are made by one thread, which lives as long as they may. It shares its memory with the
// child until that runs its program, as posix_spawn does: a fork would make the real-time threads
// pay for each page they write.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include <sys/types.h>

namespace hal {

struct ProcessStart {
    std::vector<std::string> arguments;  ///< the program first; looked up in PATH
    std::string directory;               ///< to run in; empty: this process's
    /// file descriptors for its stdout and stderr; -1: this process's
    int out = -1;
    int err = -1;
    bool keep_stdin = false;  ///< false: it reads /dev/null
};

class Spawner {
public:
    Spawner();
    ~Spawner();  ///< children that still run get SIGTERM from the kernel
    Spawner(const Spawner&) = delete;

    /// Starts a program, in the environment of a program of that instance. Returns 0 with the
    /// reason in `problem`.
    pid_t start(const ProcessStart& start, const std::string& instance, std::string& problem);

private:
    struct Job;
    void work();
    pid_t make_child(Job& job);

    static constexpr std::size_t stack_size = std::size_t{64} << 10;
    std::unique_ptr<std::byte[]> stack_;
    std::mutex mutex_;
    std::condition_variable changed_;
    Job* job_ = nullptr;
    bool ending_ = false;
    std::thread thread_;
};

/// When a process started, in clock ticks since the system did; 0: unknown.
unsigned long long start_time(pid_t pid);

}  // namespace hal
