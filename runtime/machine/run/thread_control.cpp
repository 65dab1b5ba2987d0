// SPDX-License-Identifier: MIT
#include "machine/run/thread_control.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <deque>

#include <fcntl.h>
#include <unistd.h>

#include "base/own_descriptors.hpp"
#include "machine/run/execution_sink.hpp"
#include "machine/run/state.hpp"

namespace hal {

bool ThreadControl::start(Diagnostics* diagnostics) {
    SessionState& s = state_;
    Diagnostics ignored;
    if (report_hung(diagnostics ? *diagnostics : ignored)) return false;
    bool all = true;
    for (const auto& [thread, core] : s.threads.cores()) {
        if (!s.executor->reset(*core)) {
            s.threads.report_hung(*thread, *core, diagnostics ? *diagnostics : ignored);
            all = false;
        }
    }
    if (all) {
        s.executor->start();
        if (s.options.sink) {
            s.options.sink->switched(true);
        }
        was_started_ = true;
    }
    return all;
}

std::vector<plan::Memory> ThreadControl::seen_by_components() const {
    return state_.executor->seen_by_components();
}

bool ThreadControl::report_hung(Diagnostics& diagnostics) const {
    bool any = false;
    for (const auto& thread : state_.model.threads) {
        if (const Core* const core = state_.threads.core(thread.get());
            core && core->monitor.hung()) {
            state_.threads.report_hung(*thread, *core, diagnostics);
            any = true;
        }
    }
    return any;
}

bool ThreadControl::stop(Diagnostics* diagnostics) {
    SessionState& s = state_;
    Diagnostics ignored;
    if (!s.executor->running()) return !report_hung(diagnostics ? *diagnostics : ignored);
    s.executor->stop();
    if (s.options.sink) {
        s.options.sink->switched(false);
    }
    // every thread makes its outputs safe at the end of its next cycle; see it done
    std::deque<Observation> observations;
    std::vector<std::pair<Core*, Observation*>> requests;
    for (const auto& [thread, core] : s.threads.cores()) {
        requests.emplace_back(core, &observations.emplace_back());
    }
    const bool answered = s.executor->observe(requests, answer_timeout_ns);
    if (report_hung(diagnostics ? *diagnostics : ignored)) return false;
    if (answered) return true;
    if (diagnostics) {  // not supervised, or a long period of supervision
        diagnostics->error("silent-thread", {},
                           "a thread did not stop within " +
                               format_duration(static_cast<double>(answer_timeout_ns)),
                           "", "see: show thread, show fault");
    }
    return false;
}

std::uint64_t ThreadControl::halt() {
    const Executor::Halting halting = state_.executor->halt();
    if (halting.has_run && state_.options.sink) {
        state_.options.sink->halted();
    }
    return halting.ticket;
}

ThreadControl::Halt ThreadControl::halted(std::uint64_t ticket) const {
    switch (state_.executor->halted(ticket)) {
    case Executor::Halt::pending: return Halt::pending;
    case Executor::Halt::done: return Halt::done;
    case Executor::Halt::hung: break;
    }
    return Halt::hung;
}

void ThreadControl::continue_after(std::uint64_t epoch) { state_.threads.continue_after(epoch); }

bool ThreadControl::running() const { return state_.executor->running(); }

/// Notes whether the time that advances now is time in which functions run.
void ThreadControl::note_functions() {
    const auto& threads = state_.model.threads;
    const auto has_functions = [](const auto& thread) { return !thread->functions.empty(); };
    const auto has_init = [](const auto& thread) { return !thread->init.empty(); };
    if (running() && std::any_of(threads.begin(), threads.end(), has_functions)) {
        functions_ran_ = true;
    }
    if (std::any_of(threads.begin(), threads.end(), has_init)) {
        functions_ran_ = true;
    }
}

void ThreadControl::advance_ns(std::int64_t ns) {
    note_functions();
    state_.executor->advance(ns);
}

void ThreadControl::advance_cycles(std::uint64_t cycles) {
    SessionState& s = state_;
    note_functions();
    if (s.model.threads.empty()) return;
    const Thread& fastest = *s.model.threads.front();
    const Core* const core = s.threads.core(&fastest);
    const std::uint64_t wanted = core->monitor.cycles() + cycles;
    if (s.executor->is_virtual()) return s.executor->advance_cycles(*core, cycles);
    s.executor->advance(static_cast<std::int64_t>(cycles) * fastest.options.period_ns);
    // under the real clock periods may have been missed: cycles are what was asked for
    for (int turn = 0; turn < 10'000 && core->monitor.cycles() < wanted; ++turn) {
        s.executor->advance(fastest.options.period_ns);
    }
}

bool ThreadControl::runs(std::string_view thread) const {
    const Core* const core = state_.threads.core(state_.model.find_thread(thread));
    return running() && core && !core->stopped_by_fault() && !core->monitor.hung();
}

void ThreadControl::begin_fault(std::string_view thread, const char* reason, double detail) {
    Core* const core = state_.threads.core(state_.model.find_thread(thread));
    if (!core) return;
    state_.executor->board().begin(reason, reason);
    core->raise({HAL_FAULT_COMPONENT, 0, core->cycle_number(), now_ns(), detail, reason, reason});
}

void ThreadControl::end_fault(const char* reason) { state_.executor->board().end(reason, reason); }

std::int64_t ThreadControl::now_ns() const { return state_.executor->now_ns(); }

// --- the watchdog device: the kernel resets the host when nobody writes to it for its timeout; the supervisor writes ---------------

bool ThreadControl::attach_watchdog(const std::string& path, std::string& problem) {
    SessionState& s = state_;
    if (watchdog_ >= 0) {
        problem = "a watchdog is already attached";
        return false;
    }
    const int device = ::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NONBLOCK);
    if (device < 0) {
        problem = "cannot open '" + path + "': " + std::strerror(errno);
        return false;
    }
    // a device that accepts no write would reset the host, or never protect it
    if (::write(device, "", 1) != 1) {
        problem = "cannot write to '" + path + "': " + std::strerror(errno);
        ::close(device);
        return false;
    }
    watchdog_ = device;
    list_descriptor(watchdog_, "the watchdog device");
    s.executor->supervisor().feed(device);
    return true;
}

void ThreadControl::disarm_watchdog() {
    if (watchdog_ < 0) return;
    state_.executor->supervisor().feed(-1);
    state_.executor->supervisor().fence();
    // The magic character: without it the driver resets the host after the close.
    if (::write(watchdog_, "V", 1) != 1) {
        watchdog_problem_ = std::strerror(errno);
        return;
    }
    close_own(watchdog_);
    watchdog_ = -1;
}

}  // namespace hal
