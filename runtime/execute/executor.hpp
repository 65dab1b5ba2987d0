// SPDX-License-Identifier: MIT
// All threads of one instance and the clock they share. [setup] throughout: the session calls it
// from one thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "execute/background.hpp"
#include "execute/core.hpp"
#include "execute/cycle_schedule.hpp"
#include "execute/runner.hpp"
#include "execute/supervisor.hpp"
#include "execute/virtual_clock.hpp"

namespace hal {

class Executor {
public:
    /// `virtual_clock`: no operating-system threads; cycles run in advance().
    explicit Executor(bool virtual_clock);
    /// The cycles of a journal in the place of a clock: waiting for a thread executes them.
    explicit Executor(CycleSchedule& schedule);
    ~Executor();
    Executor(const Executor&) = delete;

    /// Creates a thread, which serves its inbox at once. Returns its core, which lives until
    /// remove().
    Core& add(const CoreOptions& options, ThreadPins pins);
    /// The cycles of all threads have a journal. Before the first thread and instance.
    void begin_journal() { journaled_ = true; }
    /// Returns what gates of functions that share state have in common; nullptr: no journal.
    const plan::Gate* gate() const { return journaled_ || schedule_ ? &gate_ : nullptr; }
    /// Returns what components see of the supervisor.
    const hal_supervision& seen_supervision() const {
        return journaled_ || schedule_ ? seen_supervision_ : supervisor_.shared;
    }
    /// Returns the number of the next thread that add() creates.
    std::uint32_t next_id() const { return next_id_; }
    /// Sets a thread's outputs to their safe values and ends it. Returns false when it hangs or
    /// does not end within `timeout_ns`.
    bool remove(Core& core, std::int64_t timeout_ns);
    /// Sets the outputs of a thread that does not end to their safe values and stops its functions.
    void abandon(Core& core);
    /// Lets functions that a fault stopped run again. Returns false when the thread hangs.
    bool reset(Core& core);

    void start() { running_.store(true, std::memory_order_release); }
    /// Returns whether the functions ran.
    bool stop() { return running_.exchange(false, std::memory_order_acq_rel); }
    bool running() const { return running_.load(std::memory_order_acquire); }
    /// Ends the rows of probes: cycles without functions give none, because the machine ends. [any]
    void end_rows();
    struct Halting {
        std::uint64_t ticket = 0;  ///< for halted()
        bool has_run = false;  ///< functions ran before
    };
    /// Does the same as end_rows() and stop(), from any thread, and wakes slow threads. [any]
    Halting halt();
    enum class Halt { pending, done, hung };
    /// Returns whether the outputs of all threads have had their safe values since halt() returned
    /// the ticket. [any]
    Halt halted(std::uint64_t ticket) const;

    /// Returns the threads that hang, or do not end their current cycle within the timeout. Called
    /// before an edit, so that a hung thread rejects it before any other thread has taken its part.
    std::vector<Core*> hanging(std::int64_t timeout_ns) const;
    /// Offers plans and waits until each thread has taken its own. Returns the cores that did not
    /// within the timeout; their plans are withdrawn.
    std::vector<Core*> swap(const std::vector<std::pair<Core*, plan::Plan*>>& plans,
                            std::int64_t timeout_ns);
    /// The same for probes, while the plans stay.
    std::vector<Core*> swap(const std::vector<std::pair<Core*, plan::ProbeSet*>>& probes,
                            std::int64_t timeout_ns);
    /// Waits for all observations. Returns false when a thread did not answer; its observation is
    /// withdrawn.
    bool observe(const std::vector<std::pair<Core*, Observation*>>& observations,
                 std::int64_t timeout_ns);
    /// Queues a batch of at most Core::max_writes writes per thread; each batch takes effect in
    /// one cycle. Waits while a queue is full. Returns false and queues nothing when it stays full
    /// for the timeout.
    bool write(const std::vector<std::pair<Core*, std::vector<Write>>>& rows,
               std::int64_t timeout_ns);
    /// Changes the priority of a running SCHED_FIFO thread: threads with a shorter period were
    /// added or removed.
    void set_priority(Core& core, int priority);

    /// Runs, under the virtual clock, until this thread has finished `cycles` more cycles, with all
    /// other cycles due until then.
    void advance_cycles(const Core& core, std::uint64_t cycles);
    /// Runs, under the virtual clock, every cycle due within the next `ns`, the fastest thread
    /// first at equal instants. Waits for that time under the real clock.
    void advance(std::int64_t ns);
    std::int64_t now_ns() const;
    bool is_virtual() const { return virtual_; }
    /// Returns true when the cycles of a journal are executed again.
    bool replays() const { return schedule_ != nullptr; }

    Granted granted(const Core& core) const;
    /// Returns the number that the system gave the thread; 0 under the virtual clock.
    int tid(const Core& core) const;
    std::int64_t spin_ns(const Core& core) const;
    /// Returns the number of page faults in the thread's cycles since its 100th.
    std::uint64_t page_faults(const Core& core) const;
    FaultBoard& board() { return board_; }
    Supervisor& supervisor() { return supervisor_; }
    const Supervisor& supervisor() const { return supervisor_; }
    const Timeline& timeline() const { return timeline_; }
    hal_clock& clock() { return timeline_.shared; }
    const hal_background& background() const { return background_.shared(); }
    /// Returns the memory that components read: faults, adjustments, the supervisor's progress.
    std::vector<plan::Memory> seen_by_components() const {
        return {{&board_, sizeof board_},
                {&timeline_.shared, sizeof timeline_.shared},
                {&seen_supervision_, sizeof seen_supervision_}};
    }
    /// Enables external clock adjustment: from now on threads poll for adjustments while they
    /// sleep; those in a long sleep do so at once.
    void lead();

private:
    void call(Runner& runner);  // the virtual clock's is served at once
    bool hangs(const Core& core, std::int64_t timeout_ns) const;
    template <class Ready>
    bool wait(Ready ready, std::int64_t timeout_ns);
    Runner& runner(const Core& core) const;
    void forget(const Runner& leaving);
    const bool virtual_;
    CycleSchedule* const schedule_ = nullptr;
    std::atomic<bool> running_{false};
    FaultBoard board_;
    Supervisor supervisor_{board_};
    Timeline timeline_;
    Background background_;
    // held while runners_ changes, and by halt() and halted(), which need no session
    mutable std::mutex runners_mutex_;
    std::vector<std::unique_ptr<Runner>> runners_;  // fastest first
    std::uint64_t halt_tickets_ = 0;  // guarded by runners_mutex_
    VirtualClock clock_{runners_, timeline_, background_, supervisor_};
    const std::int64_t epoch_ns_;  // all positions of the grid are epoch + k * period
    std::uint32_t next_id_ = 1;
    bool journaled_ = false;
    plan::GateCounters counters_;  // written by all threads in gates
    // written by threads in gates, so that a journal has what they read
    hal_supervision seen_supervision_{sizeof(hal_supervision), 0, 0};
    const plan::Gate gate_{&counters_, &supervisor_.shared.progress, &seen_supervision_.progress};
};

}  // namespace hal
