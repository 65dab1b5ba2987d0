// SPDX-License-Identifier: MIT
#include "machine/processes/child_processes.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/own_descriptors.hpp"
#include "base/poll_all.hpp"
#include "execute/core.hpp"
#include "execute/process_setup.hpp"
#include "machine/run/running_model.hpp"

namespace hal {

ChildProcesses::~ChildProcesses() {
    spawner_.reset();
    if (wake_ >= 0) {
        close_own(wake_);
    }
    for (const Watched& child : watched_) {
        close(child.pidfd);
    }
}

void ChildProcesses::wake() {
    if (wake_ >= 0) {
        eventfd_write(wake_, 1);
        return;
    }
    wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    list_descriptor(wake_, "the wake-up for child processes");
    sigset_t all_signals, before;  // signals are for the program's own thread
    sigfillset(&all_signals);
    pthread_sigmask(SIG_SETMASK, &all_signals, &before);
    reaper_ = std::thread([this] { run(); });
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void ChildProcesses::request_end() {
    ending_ = true;
    if (wake_ >= 0) {
        eventfd_write(wake_, 1);
    }
}

void ChildProcesses::join() {
    if (reaper_.joinable()) {
        reaper_.join();
    }
}

pid_t ChildProcesses::start(const ProcessStart& start, std::string& problem) {
    if (!spawner_) {
        spawner_ = std::make_unique<Spawner>();
    }
    const pid_t pid = spawner_->start(start, machine_.options().name, problem);
    if (pid == 0) return 0;
    // glibc 2.36's header cannot be used from C++
    const int pidfd = static_cast<int>(syscall(SYS_pidfd_open, pid, 0));
    if (pidfd < 0) {
        problem = std::string("its end cannot be watched: ") + std::strerror(errno);
        kill(pid, SIGKILL);
        waitpid(pid, nullptr, 0);
        return 0;
    }
    watched_.push_back({pid, pidfd});
    wake();
    return pid;
}

int ChildProcesses::sleep_ms() const {
    constexpr std::int64_t max_sleep_ms = 3'600'000;
    const std::int64_t due = events_.next_due_ns();
    if (due == INT64_MAX) return -1;
    const std::int64_t remaining = std::max<std::int64_t>(due - monotonic_ns(), 0);
    return static_cast<int>(std::min((remaining + 999'999) / 1'000'000, max_sleep_ms));
}

void ChildProcesses::collect_ended() {
    for (auto child = watched_.begin(); child != watched_.end();) {
        siginfo_t info{};
        if (waitid(P_PID, static_cast<id_t>(child->pid), &info, WEXITED | WNOHANG) != 0 ||
            info.si_pid == 0) {
            ++child;
            continue;
        }
        const pid_t pid = child->pid;
        close(child->pidfd);
        child = watched_.erase(child);
        const int signal_base = info.si_code == CLD_EXITED ? 0 : 128;
        events_.child_ended(pid, signal_base + info.si_status);
    }
}

void ChildProcesses::run() {
    release_unused_stack();
    std::vector<pollfd> waiting;
    SessionLock lock = machine_.lock();
    while (!ending_) {
        const auto before = std::chrono::steady_clock::now();
        waiting.assign(1, {wake_, POLLIN, 0});
        for (const Watched& child : watched_) {
            waiting.push_back({child.pidfd, POLLIN, 0});
        }
        const int timeout_ms = sleep_ms();
        lock.unlock();
        const timespec timeout{timeout_ms / 1000, timeout_ms % 1000 * 1'000'000L};
        poll_all(waiting, timeout_ms < 0 ? nullptr : &timeout);
        lock.lock();
        eventfd_t ignored;
        eventfd_read(wake_, &ignored);
        collect_ended();
        const std::chrono::nanoseconds slept = std::chrono::steady_clock::now() - before;
        if (!ending_) {
            const std::int64_t timeout_ns = std::int64_t{timeout_ms} * 1'000'000;
            events_.act_in_time(timeout_ms < 0 ? 0 : slept.count() - timeout_ns);
        }
        events_.notify();
    }
}

}  // namespace hal
