// SPDX-License-Identifier: MIT
// Requests to end a run: Ctrl-C, SIGTERM, a client's `stop`.
#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace hal::tools {

/// How a program has ended whose exit status this is (128 + N: signal N): "ended with exit status
/// 3", "was terminated by SIGKILL".
std::string end_description(int status);

/// Handles the signals that end a run, during its lifetime: SIGINT, SIGTERM, SIGHUP, SIGQUIT,
/// SIGXCPU and SIGPWR. Construct it before any other thread. Signals whose default action would end
/// the process without a report (SIGUSR1, SIGALRM, SIGIO, real-time signals ...) are ignored from
/// then on. Nothing runs in signal handlers, unless a component unblocks one of these signals in a
/// thread: then a handler requests the end.
class StopRequest {
public:
    /// nothing: only request() ends the run, and no thread is started
    enum class Handles { signals, nothing };

    explicit StopRequest(Handles what = Handles::signals);
    ~StopRequest();
    StopRequest(const StopRequest&) = delete;

    /// Has `told` called in a helper thread when a signal arrives, to end a wait of the main
    /// thread; at once when one has arrived already.
    void when_signalled(std::function<void()> told);
    /// While on, SIGINT only calls what when_signalled() was given: it cancels the running command,
    /// not the machine. Switching handles pending signals first: a Ctrl-C that ended the command's
    /// program belongs to that command.
    void spare(bool on);

    void request() noexcept;  ///< [any]
    bool requested() const noexcept { return requested_.load(std::memory_order_acquire); }
    /// Returns the signal that requested the end, 0 for none.
    int signal() const noexcept { return signal_.load(std::memory_order_relaxed); }
    /// Returns a descriptor that stays readable once the end is requested.
    int fd() const { return event_; }
    /// Waits for a request, at most `ns` (negative: forever). Returns true when requested.
    bool wait_ns(std::int64_t ns) const;
    /// Ends that: later signals request nothing. A further Ctrl-C ends the process at once: for the
    /// clean-up after outputs have been made safe.
    void release();

private:
    void begin();
    void serve();
    void receive_signals();
    void receive_signal(int number);
    void handle_unblocked(bool on);
    static void on_unblocked(int number);
    int event_ = -1;
    int signals_ = -1;
    int done_ = -1;
    int caught_ = -1;  // eventfd: `unblocked_` was written
    std::atomic<int> unblocked_{0};  // the newest signal that on_unblocked() was called for
    std::atomic<bool> requested_{false};
    std::atomic<int> signal_{0};
    std::mutex mutex_;  // of taking signals and what they mean
    bool spare_ = false;
    std::function<void()> told_;
    std::thread thread_;
};

}  // namespace hal::tools
