// SPDX-License-Identifier: MIT
// The end of a run, asked for from outside: Ctrl-C, SIGTERM, a client's `stop`.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <thread>

namespace hal::tools {

/// Takes the signals that ask for an end while it lives: SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGXCPU and SIGPWR. Make it before any other
/// thread. Signals whose default action would end the process without a report (SIGUSR1, SIGALRM, SIGIO, real-time signals ...) are
/// ignored from then on. Nothing runs in signal handlers.
class StopRequest {
public:
    StopRequest();
    ~StopRequest();
    StopRequest(const StopRequest&) = delete;

    /// Called in a thread of its own when a signal comes, to end what the main thread waits for.
    std::function<void()> on_signal;
    /// While on, SIGINT only calls on_signal: it is for the command that runs, not for the machine. Switching takes what
    /// has come so far first: a Ctrl-C that ended the command's program still belongs to the command.
    void spare(bool on);

    void request() noexcept;      ///< [any]
    bool requested() const noexcept { return requested_.load(std::memory_order_acquire); }
    /// The signal that asked for the end; 0: none did.
    int signal() const noexcept { return signal_.load(std::memory_order_relaxed); }
    /// Readable for ever once requested.
    int fd() const { return event_; }
    /// Waits until requested, or for `ns` (negative: without end). True when requested.
    bool wait_ns(std::int64_t ns) const;
    /// From now on on_signal may be called.
    void listen();
    /// From now on it is not called any more. A further Ctrl-C ends the process at once, as it would any other: for the
    /// time when outputs are safe and the rest is tidying up.
    void release();

private:
    void serve();
    void take_signals();
    int event_ = -1, signals_ = -1, done_ = -1;
    std::atomic<bool> requested_{false};
    std::atomic<int> signal_{0};
    std::mutex mutex_;    // of taking signals and what they mean
    bool spare_ = false;
    std::thread thread_;
};

}  // namespace hal::tools
