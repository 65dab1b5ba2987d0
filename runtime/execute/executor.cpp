// SPDX-License-Identifier: MIT
#include "execute/executor.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <thread>

#include "base/keep.hpp"
#include "execute/crash_table.hpp"
#include "execute/cycle_now.hpp"

namespace hal {

Executor::Executor(bool virtual_clock)
    : virtual_(virtual_clock),
      background_(virtual_clock),
      epoch_ns_(virtual_clock ? 0 : monotonic_ns()) {}

Executor::Executor(CycleSchedule& schedule)
    : virtual_(true), schedule_(&schedule), background_(true), epoch_ns_(0) {}

Executor::~Executor() {
    while (!runners_.empty()) {
        if (remove(runners_.back()->core, 2'000'000'000)) continue;
        const std::scoped_lock own(runners_mutex_);
        // a thread that hangs in a component still uses it
        keep_for_good(std::move(runners_.back()));
        runners_.pop_back();
    }
}

Runner& Executor::runner(const Core& core) const {
    for (const auto& runner : runners_) {
        if (&runner->core == &core) return *runner;
    }
    std::abort();
}

void Executor::end_rows() {
    const std::scoped_lock own(runners_mutex_);
    for (const auto& runner : runners_) {
        runner->core.end_rows();
    }
}

Executor::Halting Executor::halt() {
    end_rows();
    const bool has_run = stop();
    const std::scoped_lock own(runners_mutex_);
    const std::uint64_t ticket = ++halt_tickets_;
    for (const auto& runner : runners_) {
        runner->core.ask_halted(ticket);
        if (!virtual_) {
            runner->call();
        }
    }
    return {ticket, has_run};
}

Executor::Halt Executor::halted(std::uint64_t ticket) const {
    const std::scoped_lock own(runners_mutex_);
    bool all = true;
    for (const auto& runner : runners_) {
        if (runner->core.monitor.hung()) return Halt::hung;
        all = all && runner->core.confirmed_halt(ticket);
    }
    return all ? Halt::done : Halt::pending;
}

Core& Executor::add(const CoreOptions& options, ThreadPins pins) {
    CoreOptions wanted = options;
    if (schedule_) {
        wanted.inputs = &schedule_->inputs_of(next_id_);
    }
    auto owned = std::make_unique<Runner>(next_id_++, wanted, pins, board_, timeline_, running_,
                                          !virtual_ || schedule_, epoch_ns_);
    Runner& runner = *owned;
    const auto place = std::upper_bound(
        runners_.begin(), runners_.end(), options.period_ns,
        [](std::int64_t period, const auto& other) { return period < other->options.period_ns; });
    {
        const std::scoped_lock own(runners_mutex_);
        runner.core.ask_halted(halt_tickets_);
        runners_.insert(place, std::move(owned));
    }
    list_core(runner.core);
    timeline_.bound(runners_.front()->options.period_ns);
    if (schedule_) {
        schedule_->begin(runner.core);
        return runner.core;
    }
    if (virtual_) {
        runner.place(clock_.now_ns());
        return runner.core;
    }
    try {
        runner.start();
    } catch (...) {
        forget(runner);
        throw;
    }
    const Granted& granted = runner.granted;
    try {
        supervisor_.add(runner.core, runner.thread, runner.tid,
                        granted.policy == Granted::Policy::fifo ? granted.priority : 0,
                        granted.cpu);
    } catch (...) {
        constexpr std::int64_t timeout_ns = 2'000'000'000;
        runner.ask_to_end();
        if (runner.join(timeout_ns)) {
            forget(runner);
        }
        throw;
    }
    return runner.core;
}

void Executor::forget(const Runner& leaving) {
    unlist_core(leaving.core);
    {
        const std::scoped_lock own(runners_mutex_);
        std::erase_if(runners_, [&](const auto& one) { return one.get() == &leaving; });
    }
    timeline_.bound(runners_.empty() ? 0 : runners_.front()->options.period_ns);
}

namespace {
// Short naps: a cycle is soon over, and the session has nothing else to do.
template <class Ready>
bool wait_for(Ready ready, std::int64_t timeout_ns) {
    const std::int64_t end = monotonic_ns() + timeout_ns;
    for (int turn = 0; !ready(); ++turn) {
        if (monotonic_ns() > end) return false;
        if (turn < 20) {
            std::this_thread::yield();
        } else {
            std::this_thread::sleep_for(std::chrono::microseconds(20));
        }
    }
    return true;
}

constexpr std::int64_t for_ever = std::numeric_limits<std::int64_t>::max() / 2;
}  // namespace

// Declared hung by the supervisor, or not supervised and in a cycle that an earlier call has
// already waited for.
bool Executor::hangs(const Core& core, std::int64_t timeout_ns) const {
    if (core.monitor.hung()) return true;
    if (schedule_) return false;
    const std::int64_t since = core.monitor.busy_since_ns();
    return since != 0 && monotonic_ns() - since > timeout_ns + 2 * core.period_ns();
}

bool Executor::remove(Core& core, std::int64_t timeout_ns) {
    Runner& leaving = runner(core);
    if (schedule_) {
        schedule_->end(core);
    }
    if (virtual_) {
        core.make_safe_at_end();
    } else if (leaving.started()) {
        const std::int64_t max_ns = timeout_ns + leaving.options.period_ns;
        leaving.ask_to_end();
        if (!wait_for([&] { return leaving.ended() || core.monitor.hung(); }, max_ns) ||
            !leaving.ended()) {
            leaving.ask_to_go_on();
            return false;
        }
        supervisor_.remove(core);  // before its pthread_t is gone
        if (!leaving.join(max_ns)) {
            leaving.ask_to_go_on();
            return false;
        }
    }
    forget(leaving);
    return true;
}

void Executor::abandon(Core& core) {
    if (virtual_) return;
    core.declare_hung();
    core.stand_in(monotonic_ns(), true);
}

bool Executor::reset(Core& core) {
    if (!virtual_) return supervisor_.reset(core);
    core.clear_stop();
    return true;
}

void Executor::call(Runner& runner) {
    if (schedule_) {
        runner.core.serve_at_rest();
    } else if (virtual_) {
        runner.core.service();
    } else {
        runner.call();
    }
}

/// Waits for a thread; in a re-execution, executes cycles until it has done its part.
template <class Ready>
bool Executor::wait(Ready ready, std::int64_t timeout_ns) {
    if (!schedule_) return wait_for(ready, timeout_ns);
    while (!ready()) {
        if (!schedule_->step()) return false;
    }
    return true;
}

std::vector<Core*> Executor::hanging(std::int64_t timeout_ns) const {
    std::vector<Core*> found;
    for (const auto& runner : runners_) {
        Core& core = runner->core;
        if (core.monitor.hung()) {
            found.push_back(&core);
            continue;
        }
        const std::int64_t since = core.monitor.busy_since_ns();
        if (since == 0 || schedule_) continue;
        if (!wait_for(
                [&] { return core.monitor.busy_since_ns() != since || hangs(core, timeout_ns); },
                for_ever) ||
            hangs(core, timeout_ns)) {
            found.push_back(&core);
        }
    }
    return found;
}

std::vector<Core*> Executor::swap(const std::vector<std::pair<Core*, plan::Plan*>>& plans,
                                  std::int64_t timeout_ns) {
    std::vector<Core*> silent;
    for (const auto& [core, plan] : plans) {
        core->offer(plan);
    }
    for (const auto& [core, plan] : plans) {
        call(runner(*core));
    }
    for (const auto& [core, plan] : plans) {
        const auto taken = [core = core, plan = plan] { return core->taken() == plan->epoch; };
        wait([&, core = core] { return taken() || core->monitor.hung(); },
             timeout_ns + 2 * core->period_ns());
        if (taken()) continue;
        if (core->withdraw(plan)) {
            silent.push_back(core);
        } else {
            wait_for(taken, for_ever);  // it is just taking it
        }
    }
    supervisor_.fence();  // the old plans and what they point to may go
    if (virtual_) {
        fence_cycle_now();
    }
    return silent;
}

std::vector<Core*> Executor::swap(const std::vector<std::pair<Core*, plan::ProbeSet*>>& probes,
                                  std::int64_t timeout_ns) {
    std::vector<Core*> silent;
    for (const auto& [core, set] : probes) {
        core->offer(set);
    }
    for (const auto& [core, set] : probes) {
        call(runner(*core));
    }
    for (const auto& [core, set] : probes) {
        const auto taken = [core = core, set = set] { return core->probes_taken() == set->epoch; };
        wait_for([&, core = core] { return taken() || hangs(*core, timeout_ns); },
                 timeout_ns + 2 * core->period_ns());
        if (taken()) continue;
        if (core->withdraw(set)) {
            silent.push_back(core);
        } else {
            wait_for(taken, for_ever);  // it is just taking it
        }
    }
    return silent;
}

bool Executor::observe(const std::vector<std::pair<Core*, Observation*>>& observations,
                       std::int64_t timeout_ns) {
    for (const auto& [core, observation] : observations) {
        core->observe(observation);
    }
    for (const auto& [core, observation] : observations) {
        call(runner(*core));
    }
    bool all = true;
    for (const auto& [core, observation] : observations) {
        const auto done = [observation = observation] {
            return observation->done.load(std::memory_order_acquire);
        };
        wait([&, core = core] { return done() || hangs(*core, timeout_ns); },
             timeout_ns + 2 * core->period_ns());
        if (done()) continue;
        if (core->withdraw(observation)) {
            all = false;
        } else {
            wait_for(done, for_ever);  // it is being answered: never free it under the thread
        }
    }
    return all;
}

bool Executor::write(const std::vector<std::pair<Core*, std::vector<Write>>>& rows,
                     std::int64_t timeout_ns) {
    for (const auto& [core, row] : rows) {
        if (hangs(*core, timeout_ns)) return false;
    }
    for (const auto& [core, row] : rows) {
        const auto fits = [&, core = core, needed = row.size()] {
            return core->capacity() >= needed;
        };
        if (fits()) continue;
        wait([&, core = core] {
            call(runner(*core));
            return fits() || hangs(*core, timeout_ns);
        }, timeout_ns + 2 * core->period_ns());
        if (!fits()) return false;
    }
    for (const auto& [core, row] : rows) {
        core->write(row.data(), row.size());
        if (virtual_ && !schedule_) {
            core->service();
        }
    }
    return true;
}

void Executor::set_priority(Core& core, int priority) {
    Runner& target = runner(core);
    if (virtual_ || target.granted.policy != Granted::Policy::fifo ||
        target.granted.priority == priority) {
        return;
    }
    supervisor_.set_priority(core, priority);
    target.granted.priority = priority;
}

void Executor::advance(std::int64_t ns) {
    if (!virtual_) {
        const std::int64_t until = monotonic_ns() + ns;
        const timespec at = to_timespec(until);
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) == EINTR) {
        }
        return;
    }
    clock_.advance(ns);
}

void Executor::advance_cycles(const Core& core, std::uint64_t cycles) {
    clock_.advance_cycles(runner(core), cycles);
}

void Executor::lead() {
    timeline_.lead();
    for (const auto& runner : runners_) {
        if (!virtual_) {
            runner->call();
        }
    }
}

std::int64_t Executor::now_ns() const {
    if (schedule_) return schedule_->now_ns();
    return virtual_ ? clock_.now_ns() : monotonic_ns();
}

Granted Executor::granted(const Core& core) const { return runner(core).granted; }

int Executor::tid(const Core& core) const { return runner(core).tid; }

std::int64_t Executor::spin_ns(const Core& core) const { return runner(core).spin_ns(); }

std::uint64_t Executor::page_faults(const Core& core) const {
    return virtual_ ? 0 : runner(core).page_faults();
}

}  // namespace hal
