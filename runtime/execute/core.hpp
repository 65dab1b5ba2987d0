// SPDX-License-Identifier: MIT
// The work of one real-time thread without the operating-system thread: the cycle, the inbox, the
// statistics. The same code runs under the real and the virtual clock. This file and core.cpp
// define a cycle.
#pragma once

#include <algorithm>
#include <atomic>
#include <csetjmp>
#include <cstdint>
#include <utility>
#include <vector>

#include "execute/cycle_inputs.hpp"
#include "execute/cycle_mark.hpp"
#include "execute/cycle_monitor.hpp"
#include "execute/faults.hpp"
#include "execute/histogram.hpp"
#include "execute/mode_check.hpp"
#include "execute/stop_flag.hpp"
#include "execute/timeline.hpp"
#include "execute/trace.hpp"
#include "hal/abi.h"
#include "hal/clock.hpp"
#include "hal/queue.hpp"
#include "plan/plan.hpp"

namespace hal {

/// A value for a pin or slot of this thread, put in the queue by the session.
struct Write {
    hal_value* to;
    hal_value value;
};

/// A request for values of this thread, all from one finished cycle. The session fills it in, the
/// thread answers it.
struct Observation {
    const hal_value* const* from = nullptr;
    hal_value* to = nullptr;
    std::size_t count = 0;
    std::uint64_t cycle = 0;              ///< number of that cycle; written by the thread
    /// Not 0: cycles depend on the answer, and a journal has which cycle gave it.
    std::uint64_t number = 0;
    std::atomic<bool> done{false};
};

/// Pins of the model that show the state of the thread.
struct ThreadPins {
    hal_pin *time, *tmax, *tmax_increased, *beat, *missed, *wakeup;
};

class Core {
public:
    Core(std::uint32_t id, std::int64_t period_ns, ThreadPins pins, FaultBoard& board,
         Timeline& timeline, const std::atomic<bool>& running, bool measure,
         CycleMark* mark = nullptr, CycleInputs* inputs = nullptr);
    ~Core();
    Core(const Core&) = delete;

    // --- by the thread ---------------------------------------------------------------------------
    /// Runs the cycle at position `grid_ns`, which was due at `due_ns`. The thread woke at
    /// `woke_ns`, just now; the execution time counts from then. [realtime]
    void cycle(std::int64_t grid_ns, std::int64_t due_ns, std::int64_t woke_ns) noexcept;
    /// Takes a new plan and queued writes and answers an observation, between two cycles.
    /// [realtime]
    void service() noexcept;
    /// Prefetches the memory of the next cycle into the caches until `until_ns` at most. [realtime]
    void warm(std::int64_t until_ns) const noexcept;
    /// Counts periods in which no cycle ran. [realtime]
    void skip(std::uint64_t periods) noexcept;
    /// Checks the start of the cycle that was due at `due_ns`: a delay above the supervision limit
    /// is a fault that stops the thread. [realtime]
    void woke_late(std::int64_t due_ns, std::int64_t now_ns) noexcept;
    /// Writes all declared safe values and calls the emergency functions. [realtime] and in a crash
    /// handler
    void make_safe() noexcept;
    /// Does the same at the end of the thread; waits while the supervisor does it. Not in a cycle
    void make_safe_at_end() noexcept;
    void raise(FaultEvent event) noexcept;
    /// Notes the order of functions that share state, and their state when another one runs at the
    /// same time; in a re-execution, waits for it. [realtime]
    void enter(plan::Gate& gate) noexcept;
    void leave(plan::Gate& gate) noexcept;
    /// Notes what the running function reads outside of the machine: a clock, a random number.
    /// Returns what it gets, which is from the journal in a re-execution. [realtime]
    std::uint64_t note_reading(std::uint64_t value) noexcept {
        return inputs_ && in_component() && !reads_itself_ ? inputs_->note(value) : value;
    }
    /// Returns what takes the results of calls that the running function makes; nullptr: nothing.
    /// [realtime]
    CycleInputs* results() noexcept { return in_component() ? inputs_ : nullptr; }
    /// The readings of the calling thread are those of a driver, whose results are noted. Returns
    /// what it was before. [realtime]
    bool hide_readings(bool hidden) noexcept { return std::exchange(reads_itself_, hidden); }
    /// Records a frame that the running function sends or receives. [realtime]
    void trace_frame(TraceEvent::Kind kind, std::uint32_t id, std::size_t bytes) noexcept;
    /// Shifts the grid for all positions after that of this cycle; does nothing outside a function.
    /// [realtime]
    void step_clock(std::int64_t ns) noexcept;

    // --- by the supervisor, in a thread of its own (supervisor.hpp) ------------------------------
    /// Stops the thread's functions because the running or due cycle does not end. Returns false if
    /// they were stopped already. [any]
    bool declare_hung() noexcept;
    /// Notes the function that runs, so that an overrun report can name it.
    void sample() noexcept { monitor.sample(*mark_); }
    /// Acts for a thread that hangs: writes the safe values, with `emergency` calls the emergency
    /// functions, counts the missed periods, and publishes the result to other threads.
    void stand_in(std::int64_t now_ns, bool emergency) noexcept;
    /// Returns the function that the cycle is running; 0: none.
    std::uint32_t hung_function() const noexcept;

    // --- by a re-execution, between two cycles ---------------------------------------------------
    enum class Missing : std::uint8_t {
        nothing,
        edit,  ///< a plan, a write or an observation of the session
        cycle,  ///< the finished cycle of another thread
    };
    /// Returns what the record in the inputs of this thread needs and does not exist yet.
    Missing missing() const noexcept;
    /// Executes the cycle of the record in the inputs.
    void replay() noexcept;
    /// This process is a copy that continues the re-execution.
    void continue_in_copy() noexcept { stopped_.continue_in_copy(); }
    /// Takes offered probes, and answers an observation without a number.
    void serve_at_rest() noexcept;
    /// Takes what the session offers, without a cycle. Returns false when there was nothing.
    bool catch_up();
    /// Returns true when the outputs have their safe values, because functions do not run. Between
    /// two cycles of a re-execution.
    bool is_safe() const noexcept { return safe_; }
    /// Returns true when the thread has taken all that the session has offered.
    bool at_rest() const noexcept;
    /// What the next cycle depends on, besides the memory of the plan and of the instances.
    struct Remains {
        std::uint64_t writes = 0;  ///< total, all of which have been applied
        std::uint64_t sampled = 0;  ///< the function whose time is measured next
        bool safe = true;
        bool in_budget = true;
        bool passed = false;
        bool stopped = false;
        std::uint64_t safe_number = 0;  ///< of the cycle in which the outputs became safe
        std::vector<bool> bad_outputs = {};  ///< of the finite checks, in order
    };
    Remains remains() const;
    void set_remains(const Remains& remains);
    plan::Plan* plan() const noexcept { return plan_; }

    // --- by the session --------------------------------------------------------------------------
    /// Puts a plan in the inbox; the thread answers by storing its epoch in taken().
    void offer(plan::Plan* plan) { inbox_.store(plan, std::memory_order_release); }
    /// Withdraws an unanswered plan. Returns false if the thread has taken it already.
    bool withdraw(plan::Plan* plan) {
        return inbox_.compare_exchange_strong(plan, nullptr, std::memory_order_acq_rel);
    }
    std::uint64_t taken() const { return taken_.load(std::memory_order_acquire); }
    /// For a plan of another thread that must be taken after the plan `epoch` of this one.
    plan::Precedence precedence(std::uint64_t epoch) const { return {&taken_, epoch}; }
    /// The same for probes, which change while the plan stays. A later plan brings its own.
    void offer(plan::ProbeSet* probes) { probe_inbox_.store(probes, std::memory_order_release); }
    bool withdraw(plan::ProbeSet* probes) {
        return probe_inbox_.compare_exchange_strong(probes, nullptr, std::memory_order_acq_rel);
    }
    /// From now on a cycle in which no function runs gives no row: the machine ends. [any]
    void end_rows() noexcept { rows_end_.store(true, std::memory_order_relaxed); }
    std::uint64_t probes_taken() const { return probes_taken_.load(std::memory_order_acquire); }
    /// Queues a batch of writes, all of which take effect in the same cycle. Returns false and
    /// queues none if the queue is full.
    bool write(const Write* row, std::size_t count) {
        if (!writes_.push(row, count)) return false;
        pushed_ += count;
        return true;
    }
    static constexpr std::size_t max_writes = 4096;  ///< largest batch
    /// Returns how many writes were queued since the thread exists.
    std::uint64_t queued_writes() const { return pushed_; }
    /// Returns the remaining capacity in writes; the thread only increases it.
    std::size_t capacity() const { return writes_.capacity() - writes_.size(); }
    /// Returns true when all queued writes have been applied.
    bool settled() const { return applied_.load(std::memory_order_acquire) == pushed_; }
    void observe(Observation* observation) {
        observation_.store(observation, std::memory_order_release);
    }
    bool withdraw(Observation* observation) {
        return observation_.compare_exchange_strong(observation, nullptr,
                                                    std::memory_order_acq_rel);
    }
    /// Begins to record events in the ring, or ends it with nullptr. The ring must outlive the
    /// thread: a cycle that runs may still write to it.
    void trace(TraceRing* ring) { trace_.store(ring, std::memory_order_release); }
    bool traced() const { return trace_.load(std::memory_order_relaxed) != nullptr; }
    bool next_fault(FaultEvent& event) { return faults_.pop(event); }
    /// Returns true after the first pass of the thread, in which initf functions run.
    bool passed() const { return passed_.load(std::memory_order_acquire); }
    void clear_stop() noexcept;
    /// A condition that a fault reports begins or is over (FaultBoard::begin). `pin`: of an output
    /// that is not finite. [realtime]
    void not_finite(const hal_pin& pin, bool lasts) noexcept;
    /// What owns the lasting condition of a fault of this thread, and its key; two nullptrs: the
    /// fault is an event. [any]
    struct Condition {
        const void *owner, *key;
    };
    Condition condition(const FaultEvent& event) const noexcept;
    /// Asks the thread to confirm that it has seen a stop: `ticket` is larger than those before.
    /// The thread confirms it when its outputs have their safe values. [any], one caller at a time
    void ask_halted(std::uint64_t ticket) noexcept {
        halt_asked_.store(ticket, std::memory_order_release);
    }
    /// Returns true when the thread has confirmed this ticket or a later one. [any]
    bool confirmed_halt(std::uint64_t ticket) const noexcept {
        return halt_seen_.load(std::memory_order_acquire) >= ticket;
    }

    /// Returns the mark that the thread was given; nullptr: it has one of its own.
    const CycleMark* mark() const { return mark_ == &own_mark_ ? nullptr : mark_; }
    std::uint32_t id() const { return id_; }
    std::int64_t period_ns() const { return period_ns_; }
    CycleMonitor monitor;  ///< of its cycles
    std::atomic<std::int64_t> budget_ns{0};
    /// A cycle that takes this many periods is a fault, whatever the budget.
    static constexpr std::int64_t max_overrun = 10;
    std::atomic<bool> profile_every{false};
    Histogram wakeup, busy;  ///< written by the thread
    /// Cycles that ended after the next deadline; cycles over the budget or of `max_overrun` periods.
    /// Written by the thread.
    std::atomic<std::uint64_t> overruns{0}, over_budget{0};
    /// Returns a duration as the pins of a thread show it: 2.1 s also for longer ones.
    static std::int32_t pin_ns(std::int64_t ns) noexcept {
        return static_cast<std::int32_t>(std::min<std::int64_t>(ns, INT32_MAX));
    }
    bool stopped_by_fault() const { return stopped_.load(std::memory_order_acquire); }

    /// Returns the core whose functions run on the calling thread, or nullptr; for crash and
    /// terminate handlers.
    static Core* current() noexcept;
    /// Continues a cycle that a re-execution has left in a gate.
    static void set_current(Core* core) noexcept;
    std::uint32_t current_function() const noexcept;
    /// the same, seen from another thread
    std::uint32_t interrupted_function() const noexcept;
    std::uint64_t cycle_number() const noexcept { return info_.number; }
    bool in_function() const noexcept { return mark_->in_function.load(std::memory_order_relaxed); }
    /// Returns true in a function, and in an emergency function that the thread calls.
    bool in_component() const noexcept { return in_function() || in_emergency_; }
    /// Where the cycle continues when a function does not return to it: Left.
    std::jmp_buf recover;
    enum Left : int { threw = 1, ended_thread = 2 };
    /// The running function has copied the process: a fault that names it. [realtime]
    void note_fork() noexcept;
    /// The running function reads what no journal has: a fault that names it. [realtime]
    void note_outside_reading() noexcept;
    /// A floating-point exception of the running function trapped, and is masked now. In a signal
    /// handler of the thread
    void note_trap() noexcept { modes_.note_trap(); }

private:
    void begin_cycle(std::int64_t grid_ns, std::int64_t due_ns, std::int64_t woke_ns) noexcept;
    /// Imports, runs the functions unless the machine or the thread is stopped, publishes, and
    /// answers the session. Returns when the functions ended.
    std::int64_t execute_plan(std::int64_t due_ns, std::int64_t woke_ns) noexcept;
    /// Applies queued writes, an offered plan and offered probes.
    void apply_edits() noexcept;
    static bool is_due(const plan::Plan& plan) noexcept;
    /// Makes the plan the one that the cycles run, with the values and the state of the one before.
    void adopt(plan::Plan* plan) noexcept;
    plan::Plan* offered_plan() noexcept;
    void drain_writes(std::uint64_t until = UINT64_MAX) noexcept;
    /// Copies what other threads have published.
    void import_values() noexcept;
    std::uint64_t import_values(plan::Channel& channel, const std::vector<hal_value*>& to) noexcept;
    void import_values(plan::Channel& channel, const std::vector<hal_value*>& to,
                       std::uint64_t sequence) noexcept;
    std::int64_t clock_ns() noexcept;
    std::int64_t unnoted_clock_ns() noexcept;
    std::uint64_t note(std::uint64_t value) noexcept {
        return inputs_ ? inputs_->note(value) : value;
    }
    std::uint64_t pass(plan::Gate& gate, bool enters, bool& overlaps) noexcept;
    void exchange(plan::SharedState& state) noexcept;
    void end_record() noexcept;
    std::uint64_t checksum() const noexcept;
    void keep_history() noexcept;
    static void publish(plan::Plan& plan) noexcept;
    /// Publishes for other threads; of a stopped thread the safe values. Confirms a stop.
    void publish_outputs() noexcept;
    /// Copies the values that the session asked for.
    bool answer_observation() noexcept;
    void take_probes() noexcept;
    void sample_probes() noexcept;
    /// Whether functions are to run; in a re-execution as in the journal.
    bool live() noexcept {
        return note(running_.load(std::memory_order_acquire) &&
                    !stopped_.load(std::memory_order_relaxed)) != 0;
    }
    std::uint32_t slow_function(std::int64_t woke_ns) const noexcept;
    void run() noexcept;
    void run_functions() noexcept;
    void run_checked() noexcept;
    void stop_at(hal_fault_code code, const char* reason) noexcept;
    void check_modes(std::uint32_t function) noexcept;
    void suspect_modes() noexcept;
    void settle_modes() noexcept;
    [[noreturn]] static void end_copy() noexcept;
    void run_timed(const plan::Function& function, const plan::Step* steps) noexcept;
    void run_rows(const plan::Row*& row, const plan::Step* first, const plan::Step* last) noexcept;
    void run_steps(const plan::Step* first, const plan::Step* last) noexcept;
    std::int64_t account(std::int64_t woke_ns, bool ran) noexcept;

    const std::uint32_t id_;
    const std::int64_t period_ns_;
    const ThreadPins pins_;
    FaultBoard& board_;
    Timeline& timeline_;
    const std::atomic<bool>& running_;
    std::atomic<TraceRing*> trace_{nullptr};  // written by the session; nullptr: not traced
    // false under the virtual clock: times are 0, so runs are identical
    const bool measure_;
    // written by the session, emptied by the thread
    std::atomic<plan::Plan*> inbox_{nullptr};
    std::atomic<std::uint64_t> taken_{0};  // written by the thread
    // written by the session, emptied by the thread
    std::atomic<plan::ProbeSet*> probe_inbox_{nullptr};
    std::atomic<std::uint64_t> probes_taken_{0};  // written by the thread
    std::atomic<bool> rows_end_{false};  // written by who ends the machine
    // written by the session, emptied by the thread
    std::atomic<Observation*> observation_{nullptr};
    // set by the thread and the supervisor, cleared by the session
    StopFlag stopped_;
    std::atomic<bool> passed_{false};  // set by the thread
    std::atomic<std::uint64_t> halt_asked_{0};  // written by who stops the machine
    std::atomic<std::uint64_t> halt_seen_{0};  // written by the thread
    // Whose turn it is to make outputs safe and to publish: the thread in each cycle, the
    // supervisor in place of a hung thread.
    //   1. thread: nobody -> thread      2. make safe if stopped, publish      3. thread -> nobody     (release)
    //   4. supervisor: stopped := true, nobody -> supervisor (acquire)         5. make safe, publish   6. supervisor -> nobody
    // When the supervisor is between 4 and 6 the thread does neither and tries again in its next
    // cycle; between 1 and 3 the supervisor writes safe values without publishing, and the thread,
    // which then is alive, finds itself stopped in its next cycle.
    enum Turn : int { nobody, thread, supervisor };
    std::atomic<int> turn_{nobody};
    std::atomic<plan::Plan*> shown_{nullptr};  // plan_, for the supervisor
    Queue<Write> writes_{max_writes};  // session to thread
    std::uint64_t pushed_ = 0;  // the session's own
    std::atomic<std::uint64_t> applied_{0};  // written by the thread
    Queue<FaultEvent> faults_{256};  // thread to session
    FaultLimiter limiter_;  // the thread's own
    plan::Plan* plan_ = nullptr;  // the rest is the thread's own
    plan::ProbeSet* probes_ = nullptr;
    TraceRing* tracing_ = nullptr;  // trace_ during a cycle
    hal_cycle info_{};  // its address identifies the thread, FunctionPair
    std::int64_t grid_ns_ = 0;  // position of the cycle that runs
    CycleMark own_mark_;
    CycleMark* const mark_;  // own_mark_, or one in shared memory
    CycleInputs* const inputs_;  // nullptr: no journal
    bool reads_itself_ = false;  // not the running function
    bool in_emergency_ = false;
    bool safe_ = true;
    std::uint64_t safe_number_ = 0;  // of the cycle in which the outputs became safe
    std::size_t sampled_ = 0;
    bool in_budget_ = true;
    ModeCheck modes_;
};

/// The steps that the compiler inserts before and after a function that shares state with one of
/// another thread; `self` is a plan::Gate. [realtime]
void enter_gate(void* self, const hal_cycle* cycle);
void leave_gate(void* self, const hal_cycle* cycle);

/// The step that the compiler inserts after a function with a declared-finite output; `self` is a
/// plan::FiniteCheck whose sink is the Core. [realtime]
void check_finite(void* self, const hal_cycle* cycle);

}  // namespace hal
