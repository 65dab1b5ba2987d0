// SPDX-License-Identifier: MIT
// Starts, stops and advances the threads of a session, and feeds a watchdog device while they make
// progress.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "plan/plan.hpp"
#include "text/source.hpp"

namespace hal {

class Diagnostics;
struct SessionState;

/// Part of a Session. [setup]
class ThreadControl {
public:
    explicit ThreadControl(SessionState& state) : state_(state) {}

    /// Starts all threads, also those that a fault stopped. Returns false after reporting when one
    /// hangs; then no thread that was stopped is started.
    bool start(Diagnostics* diagnostics = nullptr);
    /// Stops the functions and sets the outputs to their safe values. Returns false after reporting
    /// when a thread does not answer; the outputs of a thread that hangs are safe all the same.
    bool stop(Diagnostics* diagnostics = nullptr);
    /// Reports the threads that hang as errors. Returns false when no thread hangs.
    bool report_hung(Diagnostics& diagnostics) const;
    bool running() const;
    /// Makes the plans of the next edit have the epochs that they had in a journaled machine;
    /// `epoch` is that of the plans before it.
    void continue_after(std::uint64_t epoch);
    /// Returns the memory of the machine that components read.
    std::vector<plan::Memory> seen_by_components() const;
    /// Returns true when start() was successful once.
    bool was_started() const { return was_started_; }
    /// Notes a command that lets time pass. Returns true for the first one, whose text is needed
    /// later.
    bool note_advance(Span command) {
        if (first_advance_.known()) return false;
        first_advance_ = command;
        return true;
    }
    /// Returns true when time has advanced while functions could run.
    bool functions_ran() const { return functions_ran_; }
    /// Returns the first command that was noted, or an unknown span.
    Span first_advance() const { return first_advance_; }
    /// Stops the functions as stop() does, but waits for nothing and nobody: needs no lock of the
    /// session. Returns a ticket for halted(). [any]
    std::uint64_t halt();
    enum class Halt {
        pending,
        done,  ///< the outputs of all threads have their safe values
        hung  ///< a thread hangs: stop() reports it
    };
    /// Returns how far the halt with this ticket is. Needs no lock of the session. [any]
    Halt halted(std::uint64_t ticket) const;

    /// Virtual clock: runs the threads for `ns`. Real clock: waits for `ns`.
    void advance_ns(std::int64_t ns);
    /// The same for `cycles` cycles of the fastest thread.
    void advance_cycles(std::uint64_t cycles);
    /// Returns true while the functions of a thread run: they are started, and no fault has stopped
    /// them. False for an unknown thread.
    bool runs(std::string_view thread) const;
    /// Virtual clock: raises a fault of the thread, as hal_faults::raise does for its functions,
    /// that lasts until end_fault(). `reason` outlives the session, and its address is what
    /// end_fault() knows. Does nothing for an unknown thread.
    void begin_fault(std::string_view thread, const char* reason, double detail);
    void end_fault(const char* reason);
    /// The runtime's clock: CLOCK_MONOTONIC or the virtual clock.
    std::int64_t now_ns() const;

    /// Feeds a watchdog device (Linux watchdog API) while all supervised threads make progress.
    /// Returns false and sets `problem` to the reason.
    bool attach_watchdog(const std::string& path, std::string& problem);
    /// Closes the watchdog device so that it does not reset the host.
    void disarm_watchdog();
    /// Returns true when there is no watchdog device or it accepted the disarming.
    bool watchdog_disarmed() const { return watchdog_ < 0; }
    /// Returns why the watchdog device rejected the disarming. Empty: it was not asked to, because
    /// a thread does not end.
    const std::string& watchdog_problem() const { return watchdog_problem_; }

private:
    SessionState& state_;
    void note_functions();

    bool was_started_ = false;
    bool functions_ran_ = false;
    Span first_advance_;
    int watchdog_ = -1;  // the open device, until it is disarmed
    std::string watchdog_problem_;
};

}  // namespace hal
