// SPDX-License-Identifier: MIT
#include "execute/core.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <ctime>
#include <functional>

#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "execute/float_modes.hpp"
#include "execute/violation.hpp"

// The real-time guard: the sanitizer's runtime defines these when the program is built with it.
extern "C" {
[[gnu::weak]] void __rtsan_realtime_enter();
[[gnu::weak]] void __rtsan_realtime_exit();
}

namespace hal {
namespace {
constexpr std::uintptr_t cache_line = 64;

void fetch_times(const plan::FunctionTimes& times) noexcept {
    for (std::uintptr_t at = 0; at < sizeof times; at += cache_line) {
        __builtin_prefetch(reinterpret_cast<const char*>(&times) + at, 1);
    }
}

thread_local Core* current_core = nullptr;

// the shell may look at any moment
void store(hal_pin& pin, std::int32_t value) noexcept {
    __atomic_store_n(&pin.slot->s32, value, __ATOMIC_RELAXED);
}
void store(hal_pin& pin, std::uint32_t value) noexcept {
    __atomic_store_n(&pin.slot->u32, value, __ATOMIC_RELAXED);
}
void store(hal_pin& pin, bool value) noexcept {
    __atomic_store_n(&pin.slot->bit, value, __ATOMIC_RELAXED);
}

/// Returns the function that a step of the plan belongs to; 0: none.
std::uint32_t function_of(const plan::Plan* plan, const plan::Step* step) noexcept {
    if (!plan || !step) return 0;
    const auto among = [step](const std::vector<plan::Step>& steps,
                              const std::vector<plan::Function>& functions) -> std::uint32_t {
        const std::less<> before;
        if (before(step, steps.data()) || !before(step, steps.data() + steps.size())) return 0;
        const auto at = static_cast<std::uint32_t>(step - steps.data());
        for (const plan::Function& function : functions) {
            if (at >= function.begin && at < function.end) return function.id;
        }
        return 0;
    };
    const std::uint32_t cyclic = among(plan->steps, plan->functions);
    return cyclic != 0 ? cyclic : among(plan->init_steps, plan->init);
}

struct Current {  // outlives no core: on the virtual clock the session's own thread runs them all
    explicit Current(Core* core) noexcept { current_core = core; }
    ~Current() { current_core = nullptr; }
};

/// A re-execution is not real time: it keeps what other threads read later.
struct Guard {
    explicit Guard(bool is_realtime) noexcept : on(is_realtime) {
        if (on && __rtsan_realtime_enter) {
            __rtsan_realtime_enter();
        }
    }
    ~Guard() {
        if (on && __rtsan_realtime_exit) {
            __rtsan_realtime_exit();
        }
    }
    const bool on;
};

/// Returns true when an edit that the journal does not have has changed from which threads this one
/// reads: it reads the newest finished cycles then.
bool reads_other_channels(const CycleInputs* inputs, const plan::Plan& plan) noexcept {
    return inputs && inputs->replays() && !inputs->has_state() &&
           inputs->record().imports != plan.imports.size();
}

/// values that the checksum of one cycle covers
constexpr std::size_t checked_values = 64;
}  // namespace

Core* Core::current() noexcept { return current_core; }

void Core::set_current(Core* core) noexcept { current_core = core; }

Core::Core(std::uint32_t id, std::int64_t period_ns, ThreadPins pins, FaultBoard& board,
           Timeline& timeline, const std::atomic<bool>& running, bool measure, CycleMark* mark,
           CycleInputs* inputs)
    : monitor(period_ns),
      id_(id),
      period_ns_(period_ns),
      pins_(pins),
      board_(board),
      timeline_(timeline),
      running_(running),
      measure_(measure),
      mark_(mark ? mark : &own_mark_),
      inputs_(inputs) {
    info_.size = sizeof info_;
    info_.period_ns = period_ns;
    info_.period_s = static_cast<double>(period_ns) * 1e-9;
}

Core::~Core() { board_.end_all(this, this + 1); }

void Core::clear_stop() noexcept {
    stopped_.store(false, std::memory_order_release);
    board_.end(this, &stopped_);
}

void Core::not_finite(const hal_pin& pin, bool lasts) noexcept {
    if (lasts) {
        board_.begin(&info_, &pin);
    } else {
        board_.end(&info_, &pin);
    }
}

Core::Condition Core::condition(const FaultEvent& event) const noexcept {
    switch (event.code) {
    case HAL_FAULT_EXCEPTION:
    case HAL_FAULT_SILENT_THREAD: return {this, &stopped_};
    case HAL_FAULT_BUDGET: return {this, &in_budget_};
    case HAL_FAULT_NOT_FINITE: return {&info_, event.self};
    case HAL_FAULT_COMPONENT: return {event.self, event.reason};
    case HAL_FAULT_VIOLATION:
        if (event.reason == violation::ended_thread) return {this, &stopped_};
        if (event.reason == violation::float_modes) return {this, &modes_};
        break;
    case HAL_FAULT_NONE: break;
    }
    return {nullptr, nullptr};
}

void Core::cycle(std::int64_t grid_ns, std::int64_t due_ns, std::int64_t woke_ns) noexcept {
    const Current current(this);
    const Guard guard(!inputs_ || !inputs_->replays());
    begin_cycle(grid_ns, due_ns, woke_ns);
    apply_edits();
    std::int64_t end_ns = woke_ns;
    if (plan_) {
        end_ns = execute_plan(due_ns, woke_ns);
    } else {  // it has no outputs yet that a stop would make safe
        halt_seen_.store(halt_asked_.load(std::memory_order_acquire), std::memory_order_release);
    }
    ++info_.number;
    monitor.end_cycle(end_ns);
}

void Core::begin_cycle(std::int64_t grid_ns, std::int64_t due_ns, std::int64_t woke_ns) noexcept {
    grid_ns_ = grid_ns;
    info_.start_ns = due_ns;
    tracing_ = trace_.load(std::memory_order_acquire);
    if (measure_) {
        monitor.begin_cycle(due_ns, woke_ns);
        wakeup.add(woke_ns - due_ns);
    }
    if (inputs_) {
        inputs_->begin(CycleRecord::cycle, info_.number, grid_ns, due_ns, woke_ns,
                       monitor.missed());
    }
}

// A re-execution reads the journal in this order, too.
std::int64_t Core::execute_plan(std::int64_t due_ns, std::int64_t woke_ns) noexcept {
    import_values();
    const bool ran = live();
    if (ran) {
        run();
    }
    if (measure_) {
        store(*pins_.wakeup, pin_ns(woke_ns - due_ns));
    }
    const std::int64_t end_ns = account(woke_ns, ran);
    limiter_.flush(measure_ ? woke_ns : due_ns,
                   [this](const FaultEvent& e) noexcept { faults_.push(e); });
    publish_outputs();
    if (probes_ && (ran || !rows_end_.load(std::memory_order_relaxed))) {
        sample_probes();
    }
    if (inputs_) {
        end_record();
    } else {
        answer_observation();
    }
    if (tracing_) [[unlikely]] {
        const std::int64_t late_ns = std::max<std::int64_t>(woke_ns - due_ns, 0);
        tracing_->put(TraceEvent::cycle, woke_ns, monotonic_ns(), info_.number,
                      static_cast<std::uint64_t>(late_ns));
    }
    return end_ns;
}

void Core::service() noexcept {
    const Current current(this);
    const std::uint64_t applied = applied_.load(std::memory_order_relaxed);
    const plan::Plan* const before = plan_;
    if (inputs_) {
        inputs_->begin(CycleRecord::service, info_.number, grid_ns_, info_.start_ns, monotonic_ns(),
                       monitor.missed());
    }
    apply_edits();
    // before running_ is read: who asks has stopped it before
    const std::uint64_t asked = halt_asked_.load(std::memory_order_acquire);
    bool acts = false;
    if (int free = nobody; !live() && !safe_ &&
                           turn_.compare_exchange_strong(free, thread, std::memory_order_acq_rel)) {
        make_safe();
        turn_.store(nobody, std::memory_order_release);
        acts = true;
    }
    halt_seen_.store(asked, std::memory_order_release);
    if (!plan_) return;
    if (!inputs_) {
        answer_observation();
    } else if (acts || plan_ != before || inputs_->replays() || observation_.load() ||
               applied_.load(std::memory_order_relaxed) != applied) {
        end_record();
    }
}

void Core::publish_outputs() noexcept {
    int free = nobody;
    const bool mine = turn_.compare_exchange_strong(free, thread, std::memory_order_acq_rel);
    if (note(mine) == 0 || !mine) {
        if (mine) {
            turn_.store(nobody, std::memory_order_release);
        }
        return;
    }
    // before running_ is read: who asks has stopped it before
    const std::uint64_t asked = halt_asked_.load(std::memory_order_acquire);
    if (!live() && !safe_) {
        make_safe();
    }
    publish(*plan_);
    turn_.store(nobody, std::memory_order_release);
    halt_seen_.store(asked, std::memory_order_release);
}

// After a millisecond of other work neither the instances nor the code are in a near cache, and
// waiting for memory is half of the cycle's time. A thread that spins towards its deadline has the
// time to fetch them before.
void Core::warm(std::int64_t until_ns) const noexcept {
    if (!plan_) return;
    unsigned fetched = 0;
    const auto fetch = [&](const void* memory, std::size_t bytes) noexcept {
        const auto begin = reinterpret_cast<std::uintptr_t>(memory);
        for (std::uintptr_t at = begin & ~(cache_line - 1); at < begin + bytes; at += cache_line) {
            if (fetched++ % 32 == 0 && monotonic_ns() >= until_ns) return false;
            __builtin_prefetch(reinterpret_cast<const void*>(at));
        }
        return true;
    };
    if (!fetch(this, sizeof *this) || !fetch(stopped_.memory(), 1)) return;
    for (const hal_pin* pin :
         {pins_.time, pins_.tmax, pins_.tmax_increased, pins_.beat, pins_.missed, pins_.wakeup}) {
        fetch(pin, sizeof *pin);
    }
    if (sampled_ < plan_->functions.size()) {
        fetch(plan_->functions[sampled_].times, sizeof(plan::FunctionTimes));
    }
    for (const plan::Memory& memory : plan_->working_set) {
        if (!fetch(memory.begin, memory.bytes)) return;
    }
}

void Core::skip(std::uint64_t periods) noexcept {
    if (TraceRing* const tracing = trace_.load(std::memory_order_acquire)) {
        const std::int64_t now_ns = monotonic_ns();
        tracing->put(TraceEvent::missed, now_ns, now_ns, info_.number + periods, periods);
    }
    info_.number += periods;
    monitor.skip(periods);
    store(*pins_.missed, static_cast<std::uint32_t>(monitor.missed()));
}

// The inbox first: a write that was queued before a plan was offered goes to the places of the plan
// before it, and those places are gone once the new plan has been taken.
void Core::apply_edits() noexcept {
    plan::Plan* const offered = offered_plan();
    const bool replays = inputs_ && inputs_->replays();
    drain_writes(replays ? inputs_->record().writes_before : UINT64_MAX);
    if (inputs_) {
        inputs_->took(offered ? offered->epoch : 0, applied_.load(std::memory_order_relaxed));
    }
    if (offered) {
        TraceRing* const tracing = trace_.load(std::memory_order_acquire);
        const std::int64_t begin_ns = tracing ? monotonic_ns() : 0;
        adopt(offered);
        if (tracing) {
            tracing->put(TraceEvent::plan, begin_ns, monotonic_ns(), info_.number, 0);
        }
    }
    take_probes();
}

/// Empties the inbox once the plan may be taken; in a re-execution in the cycle that did so.
plan::Plan* Core::offered_plan() noexcept {
    if (inputs_ && inputs_->replays() && inputs_->record().epoch == 0) return nullptr;
    const plan::Plan* const offered = inbox_.load(std::memory_order_acquire);
    if (!offered || !is_due(*offered)) return nullptr;
    return inbox_.exchange(nullptr, std::memory_order_acq_rel);
}

void Core::take_probes() noexcept {
    if (!probe_inbox_.load(std::memory_order_relaxed)) return;
    if (plan::ProbeSet* const probes = probe_inbox_.exchange(nullptr, std::memory_order_acq_rel)) {
        probes_ = probes->probes.empty() ? nullptr : probes;
        probes_taken_.store(probes->epoch, std::memory_order_release);
    }
}

void Core::sample_probes() noexcept {
    for (const plan::Probe& probe : probes_->probes) {
        probe.ring->sample(info_.number, info_.start_ns, probe.from.data());
    }
}

/// Returns whether all other threads have taken what must precede this plan.
bool Core::is_due(const plan::Plan& plan) noexcept {
    return std::all_of(plan.after.begin(), plan.after.end(), [](const plan::Precedence& one) {
        return one.taken->load(std::memory_order_acquire) >= one.epoch;
    });
}

void Core::adopt(plan::Plan* plan) noexcept {
    // the reasons may be those of a plugin that is unloaded next
    limiter_.clear([this](const FaultEvent& e) noexcept { faults_.push(e); });
    // All old places are read before any new one is written or rebound: a value may move within one
    // image.
    for (std::size_t i = 0; i < plan->carries.size(); ++i) {
        const plan::Carry& carry = plan->carries[i];
        plan->scratch[i] = carry.from ? carry.from->raw : carry.value.raw;
    }
    for (const plan::Rebind& rebind : plan->rebinds) {
        rebind.pin->slot = rebind.slot;
    }
    for (const plan::Pointer& pointer : plan->pointers) {
        *pointer.to = pointer.slot;
    }
    for (std::size_t i = 0; i < plan->carries.size(); ++i) {
        plan->carries[i].to->raw = plan->scratch[i];
    }
    for (const plan::Handover& state : plan->handovers) {
        std::memcpy(state.to, state.from, state.bytes);
    }
    for (const plan::Handed& handed : plan->handed) {
        *handed.to = handed.value;
    }
    board_.end_all(&info_, &info_ + 1);  // the checks of the new plan begin anew
    modes_.begin_plan();
    plan_ = plan;
    probes_ = plan->probes.get();
    shown_.store(plan, std::memory_order_release);
    sampled_ = 0;
    if (inputs_ && inputs_->replays()) {
        keep_history();
    }
    taken_.store(plan->epoch, std::memory_order_release);
}

/// `until`: the total of applied writes at which a journaled cycle stopped.
void Core::drain_writes(std::uint64_t until) noexcept {
    for (Write write; applied_.load(std::memory_order_relaxed) < until && writes_.pop(write);) {
        __atomic_store_n(&write.to->raw, write.value.raw, __ATOMIC_RELAXED);
        applied_.store(applied_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
    }
}

void Core::import_values() noexcept {
    if (inputs_) {
        inputs_->reads(plan_->imports.size());
    }
    const bool is_other_plan = reads_other_channels(inputs_, *plan_);
    for (std::uint64_t i = 0; is_other_plan && i < inputs_->record().imports; ++i) {
        inputs_->note(0);
    }
    for (plan::Import& from : plan_->imports) {
        if (is_other_plan) {
            import_values(*from.channel, from.to, from.channel->published);
        } else if (!inputs_) {
            import_values(*from.channel, from.to);
        } else if (inputs_->replays()) {
            import_values(*from.channel, from.to, inputs_->note(0));
        } else {
            inputs_->note(import_values(*from.channel, from.to));
        }
    }
    for (const plan::CellImport& from : plan_->cell_imports) {
        const std::uint64_t value = note(__atomic_load_n(&from.cell->raw, __ATOMIC_RELAXED));
        __atomic_store_n(&from.to->raw, value, __ATOMIC_RELAXED);
    }
}

/// Returns which finished cycle of the writer was taken; 0: none is newer than the last one.
std::uint64_t Core::import_values(plan::Channel& channel,
                                  const std::vector<hal_value*>& to) noexcept {
    if (!(channel.middle.load(std::memory_order_acquire) & plan::Channel::fresh)) return 0;
    channel.front = channel.middle.exchange(channel.front, std::memory_order_acq_rel) & 3;
    const hal_value* values = channel.buffers[channel.front].get();
    for (std::size_t i = 0; i < to.size(); ++i) {
        __atomic_store_n(&to[i]->raw, values[i].raw, __ATOMIC_RELAXED);
    }
    return channel.sequences[channel.front];
}

/// Takes the finished cycle that the journaled one took; 0: none.
void Core::import_values(plan::Channel& channel, const std::vector<hal_value*>& to,
                         std::uint64_t sequence) noexcept {
    if (sequence == 0 || !channel.history) return;
    auto& entries = channel.history->entries;
    while (!entries.empty() && entries.front().first < sequence) {
        entries.pop_front();
    }
    if (entries.empty()) return;
    const std::vector<hal_value>& values = entries.front().second;
    for (std::size_t i = 0; i < to.size(); ++i) {
        to[i]->raw = values[i].raw;
    }
}

void Core::publish(plan::Plan& plan) noexcept {
    for (plan::Export& to : plan.exports) {
        plan::Channel& channel = *to.channel;
        hal_value* values = channel.buffers[channel.back].get();
        // the supervisor publishes too, while a function that hung may continue and write its pins
        for (std::size_t i = 0; i < to.from.size(); ++i) {
            values[i].raw = __atomic_load_n(&to.from[i]->raw, __ATOMIC_RELAXED);
        }
        channel.sequences[channel.back] = ++channel.published;
        if (channel.history) [[unlikely]] {
            channel.history->entries.emplace_back(
                channel.published, std::vector<hal_value>(values, values + channel.size));
        }
        channel.back = channel.middle.exchange(channel.back | plan::Channel::fresh,
                                               std::memory_order_acq_rel) &
                       3;
    }
}

/// Returns false when nobody asked.
bool Core::answer_observation() noexcept {
    const bool replays = inputs_ && inputs_->replays();
    if (replays && inputs_->record().observation == 0) return false;
    Observation* const request = observation_.exchange(nullptr, std::memory_order_acq_rel);
    if (!request) return false;
    // who reads after having written sees what was written
    drain_writes(replays ? inputs_->record().writes_after : UINT64_MAX);
    for (std::size_t i = 0; i < request->count; ++i) {
        request->to[i].raw = __atomic_load_n(&request->from[i]->raw, __ATOMIC_RELAXED);
    }
    if (inputs_ && !replays) {
        inputs_->answered(request->number);
    }
    request->cycle = info_.number;
    request->done.store(true, std::memory_order_release);
    return true;
}

void Core::end_record() noexcept {
    const std::uint64_t sum = checksum();
    answer_observation();
    if (inputs_->replays()) {
        drain_writes(inputs_->record().writes_after);
    }
    inputs_->end(applied_.load(std::memory_order_relaxed), sum);
}

/// Covers all values of a small thread, and the next ones in each cycle of a large one.
std::uint64_t Core::checksum() const noexcept {
    constexpr std::uint64_t factor = 0x9E3779B97F4A7C15;
    const std::vector<plan::Checked>& all = plan_->checked;
    const std::size_t count = std::min(all.size(), checked_values);
    std::size_t at = count == 0 ? 0 : info_.number * count % all.size();
    std::uint64_t lanes[4] = {1, 2, 3, 4};
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint64_t raw = __atomic_load_n(&all[at].value->raw, __ATOMIC_RELAXED);
        std::uint64_t& lane = lanes[i % 4];
        lane = (lane ^ (raw & all[at].mask)) * factor;
        lane ^= lane >> 29;
        at = at + 1 == all.size() ? 0 : at + 1;
    }
    return ((lanes[0] * factor + lanes[1]) * factor + lanes[2]) * factor + lanes[3];
}

std::int64_t Core::clock_ns() noexcept {
    const std::int64_t now_ns = unnoted_clock_ns();
    return static_cast<std::int64_t>(note(static_cast<std::uint64_t>(now_ns)));
}

/// The time for messages and traces, on which no value depends.
std::int64_t Core::unnoted_clock_ns() noexcept {
    const bool hidden = hide_readings(true);
    const std::int64_t now_ns = monotonic_ns();
    hide_readings(hidden);
    return now_ns;
}

/// What this thread publishes is kept until its reader takes it.
void Core::keep_history() noexcept {
    for (plan::Export& to : plan_->exports) {
        if (!to.channel->history) {
            to.channel->history = std::make_unique<plan::Channel::History>();
        }
    }
}

Core::Missing Core::missing() const noexcept {
    const CycleRecord& record = inputs_->record();
    const plan::Plan* plan = plan_;
    if (record.epoch != 0) {
        plan = inbox_.load(std::memory_order_acquire);
        if (!plan || plan->epoch != record.epoch) return Missing::edit;
        if (!is_due(*plan)) return Missing::cycle;
    }
    if (record.writes_after > pushed_) return Missing::edit;
    if (record.observation != 0) {
        const Observation* const asked = observation_.load(std::memory_order_acquire);
        if (!asked || asked->number != record.observation) return Missing::edit;
    }
    if (!plan || reads_other_channels(inputs_, *plan)) return Missing::nothing;
    const std::size_t imports = plan->imports.size();
    for (std::size_t i = 0; i < imports && i < record.imports; ++i) {
        if (plan->imports[i].channel->published < inputs_->notes()[i]) return Missing::cycle;
    }
    return Missing::nothing;
}

void Core::replay() noexcept {
    const CycleRecord record = inputs_->record();
    const DefaultFloatModes modes;
    if (record.missed > monitor.missed()) {
        skip(record.missed - monitor.missed());
    }
    info_.number = record.number;
    if (record.kind == CycleRecord::service) return service();
    cycle(record.grid_ns, record.due_ns, record.woke_ns);
}

void Core::serve_at_rest() noexcept {
    take_probes();
    Observation* const request = observation_.load(std::memory_order_acquire);
    if (!request || request->number != 0) return;
    observation_.store(nullptr, std::memory_order_release);
    for (std::size_t i = 0; i < request->count; ++i) {
        request->to[i].raw = request->from[i]->raw;
    }
    request->cycle = info_.number;
    request->done.store(true, std::memory_order_release);
}

bool Core::catch_up() {
    const plan::Plan* const before = plan_;
    const std::uint64_t applied = applied_.load();
    const plan::Plan* const offered = inbox_.load(std::memory_order_acquire);
    const Observation* const asked = observation_.load(std::memory_order_acquire);
    CycleRecord record;
    record.kind = CycleRecord::service;
    record.number = info_.number;
    record.epoch = offered ? offered->epoch : 0;
    record.writes_before = pushed_;
    record.writes_after = pushed_;
    record.observation = asked ? asked->number : 0;
    const std::uint64_t live = safe_ ? 0 : 1;  // an edit at rest stops no functions
    record.notes = 1;
    inputs_->load(record, {&live, 1});
    service();
    return plan_ != before || applied_.load() != applied || observation_.load() != asked;
}

bool Core::at_rest() const noexcept {
    return !inbox_.load() && !observation_.load() && applied_.load() == pushed_;
}

namespace {

/// Calls `use` with the finite checks of a plan, in order.
template <class Use>
void each_check(const plan::Plan* plan, Use use) {
    if (!plan) return;
    for (const std::vector<plan::Step>* const steps : {&plan->init_steps, &plan->steps}) {
        for (const plan::Step& step : *steps) {
            if (step.step == check_finite) {
                use(*static_cast<plan::FiniteCheck*>(step.self));
            }
        }
    }
}

}  // namespace

Core::Remains Core::remains() const {
    Remains remains{.writes = pushed_,
                    .sampled = sampled_,
                    .safe = safe_,
                    .in_budget = in_budget_,
                    .passed = passed_.load(),
                    .stopped = stopped_.load(std::memory_order_acquire),
                    .safe_number = safe_number_};
    each_check(plan_,
               [&](const plan::FiniteCheck& check) { remains.bad_outputs.push_back(check.bad); });
    return remains;
}

void Core::set_remains(const Remains& remains) {
    pushed_ = remains.writes;
    applied_ = remains.writes;
    const std::size_t functions = plan_ ? plan_->functions.size() : 0;
    sampled_ = remains.sampled < functions ? remains.sampled : 0;
    safe_ = remains.safe;
    safe_number_ = remains.safe_number;
    in_budget_ = remains.in_budget;
    passed_ = remains.passed;
    stopped_.store(remains.stopped, std::memory_order_release);
    std::size_t at = 0;
    each_check(plan_, [&](plan::FiniteCheck& check) {
        check.bad = at < remains.bad_outputs.size() && remains.bad_outputs[at];
        ++at;
    });
}

void Core::run() noexcept {
    safe_ = false;
    mark_->in_function.store(true, std::memory_order_relaxed);
    switch (setjmp(recover)) {
    case 0:
        run_functions();
        mark_->in_function.store(false, std::memory_order_relaxed);
        break;
    case ended_thread: stop_at(HAL_FAULT_VIOLATION, violation::ended_thread); break;
    default: stop_at(HAL_FAULT_EXCEPTION, nullptr);  // the terminate handler jumped back here
    }
    if (stopped_.in_copy()) [[unlikely]] {
        end_copy();
    }
    settle_modes();
}

void Core::run_functions() noexcept {
    const bool first = !passed_.load(std::memory_order_relaxed);
    passed_.store(true, std::memory_order_release);
    if (first && !plan_->init.empty()) {
        // initf: a cycle of its own, so that the cyclic functions start on a fresh period
        for (const plan::Function& function : plan_->init) {
            run_steps(plan_->init_steps.data() + function.begin,
                      plan_->init_steps.data() + function.end);
            check_modes(function.id);
        }
        return;
    }
    const auto& functions = plan_->functions;
    if (functions.empty()) return;
    if (modes_.each()) return run_checked();
    const plan::Step* const steps = plan_->steps.data();
    const plan::Row* row = plan_->rows.data();
    if (!measure_) {
        run_rows(row, steps, steps + functions.back().end);
    } else if (note(profile_every.load(std::memory_order_relaxed) || tracing_) != 0) {
        for (const plan::Function& function : functions) {
            run_timed(function, steps);
        }
    } else {
        const plan::Function& function = functions[sampled_];
        sampled_ = sampled_ + 1 == functions.size() ? 0 : sampled_ + 1;
        fetch_times(*function.times);  // of many functions, they are in no near cache
        run_rows(row, steps, steps + function.begin);
        run_timed(function, steps);
        run_rows(row, steps + function.end, steps + functions.back().end);
    }
    suspect_modes();
}

/// Runs functions one by one: no other function runs with the modes that one has changed.
void Core::run_checked() noexcept {
    const auto& functions = plan_->functions;
    const plan::Step* const steps = plan_->steps.data();
    const bool time_all =
        note(profile_every.load(std::memory_order_relaxed) || tracing_ != nullptr) != 0;
    const std::size_t sampled = sampled_;
    sampled_ = sampled_ + 1 == functions.size() ? 0 : sampled_ + 1;
    for (std::size_t i = 0; i < functions.size(); ++i) {
        if (stopped_.load(std::memory_order_relaxed)) return;
        const plan::Function& function = functions[i];
        if (measure_ && (time_all || i == sampled)) {
            run_timed(function, steps);
        } else {
            run_steps(steps + function.begin, steps + function.end);
        }
        check_modes(function.id);
    }
}

void Core::check_modes(std::uint32_t function) noexcept {
    const unsigned differences = modes_.take();
    if (differences == 0 || !modes_.name(function)) [[likely]]
        return;
    raise({HAL_FAULT_VIOLATION, function, info_.number, info_.start_ns,
           static_cast<double>(differences), violation::float_modes, nullptr});
}

void Core::suspect_modes() noexcept {
    if (const unsigned differences = modes_.take(); differences != 0) [[unlikely]] {
        modes_.suspect(differences);
    }
}

void Core::settle_modes() noexcept {
    const ModeCheck::Result result = modes_.end_cycle();
    if (result.begins) {
        board_.begin(this, &modes_);
    }
    if (result.unnamed != 0) {
        raise({HAL_FAULT_VIOLATION, 0, info_.number, info_.start_ns,
               static_cast<double>(result.unnamed), violation::float_modes, nullptr});
    }
    if (result.ends) {
        board_.end(this, &modes_);
    }
}

// The function that runs did not return to its cycle.
void Core::stop_at(hal_fault_code code, const char* reason) noexcept {
    mark_->in_function.store(false, std::memory_order_relaxed);
    if (stopped_.in_copy()) return;
    check_modes(current_function());
    board_.begin(this, &stopped_);
    raise({code, current_function(), info_.number, info_.start_ns, 0.0, reason, nullptr});
    stopped_.store(true, std::memory_order_release);  // publish_outputs() makes the outputs safe
}

/// `row` is one that begins at or before `first`; left at one that begins at or before `last`.
void Core::run_rows(const plan::Row*& row, const plan::Step* first,
                    const plan::Step* last) noexcept {
    for (const plan::Step* const steps = plan_->steps.data(); first != last;) {
        while (steps + row->end <= first) {
            ++row;
        }
        const plan::Step* const end = std::min(last, steps + row->end);
        // declared hung meanwhile
        if (stopped_.load(std::memory_order_relaxed)) [[unlikely]]
            return;
        if (row->run) {
            row->run(first, end, &info_, &mark_->current);
        } else {
            run_steps(first, end);
        }
        first = end;
    }
}

void Core::run_steps(const plan::Step* first, const plan::Step* last) noexcept {
    // Small functions cost little more than their call: eight per turn save the jumps, a fifth of
    // the cycle of 1000 gates. A function that returns after its thread was declared hung is the
    // last that runs.
    const auto call = [this, current = &mark_->current](const plan::Step* step) noexcept {
        *current = step;
        step->step(step->self, &info_);
        return stopped_.load(std::memory_order_relaxed);
    };
    // A processor predicts the target of a call by its place in the code: in each cycle a step is
    // called at the same of the eight, wherever the range begins, so the first ones up to a
    // multiple of eight are called one by one.
    const auto place = [](const plan::Step* step) noexcept {
        return reinterpret_cast<std::uintptr_t>(step) / sizeof(plan::Step) % 8;
    };
    for (; first != last && place(first) != 0; ++first) {
        if (call(first)) [[unlikely]]
            return;
    }
    for (; last - first >= 8; first += 8) {
        if (call(first) || call(first + 1) || call(first + 2) || call(first + 3) ||
            call(first + 4) || call(first + 5) || call(first + 6) || call(first + 7)) [[unlikely]] {
            return;
        }
    }
    for (; first != last; ++first) {
        if (call(first)) [[unlikely]]
            return;
    }
}

void Core::run_timed(const plan::Function& function, const plan::Step* steps) noexcept {
    const std::int64_t begin = clock_ns();
    run_steps(steps + function.begin, steps + function.end);
    const std::int64_t end = clock_ns();
    if (tracing_) {
        tracing_->put(TraceEvent::function, begin, end, info_.number, function.id);
    }
    const std::int32_t took = pin_ns(end - begin);
    plan::FunctionTimes& times = *function.times;
    store(times.time, took);
    const bool more = took > times.tmax.slot->s32;
    if (more) {
        store(times.tmax, took);
    }
    store(times.tmax_increased, more);
    times.samples.store(times.samples.load(std::memory_order_relaxed) + 1,
                        std::memory_order_relaxed);
    times.total_ns.store(
        times.total_ns.load(std::memory_order_relaxed) + static_cast<std::uint64_t>(took),
        std::memory_order_relaxed);
}

// Returns the time at the end of the cycle's work.
std::int64_t Core::account(std::int64_t woke_ns, bool ran) noexcept {
    store(*pins_.beat, pins_.beat->slot->u32 + 1);
    if (!measure_) return woke_ns;
    const std::int64_t now_ns = clock_ns();
    const std::int64_t busy_ns = now_ns - woke_ns;
    busy.add(busy_ns);
    if (ran) {  // as in LinuxCNC, cycles without functions have no times
        const std::int32_t took = pin_ns(busy_ns);
        store(*pins_.time, took);
        const bool more = took > pins_.tmax->slot->s32;
        if (more) {
            store(*pins_.tmax, took);
        }
        store(*pins_.tmax_increased, more);
    }
    const std::int64_t budget = budget_ns.load(std::memory_order_relaxed);
    const bool too_long = busy_ns >= max_overrun * period_ns_;
    const bool in_budget = (budget == 0 || busy_ns <= budget) && !too_long;
    const auto count = [](std::atomic<std::uint64_t>& counter) {
        counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    };
    if (now_ns - info_.start_ns > period_ns_) {
        count(overruns);
    }
    if (!in_budget) {
        count(over_budget);
    }
    const auto event = [&](hal_fault_code code) -> FaultEvent {
        return {code,           slow_function(woke_ns),       info_.number,
                info_.start_ns, static_cast<double>(busy_ns), nullptr,
                nullptr};
    };
    const auto length = static_cast<CycleMonitor::Length>(
        note(static_cast<std::uint64_t>(monitor.length(woke_ns, now_ns))));
    const bool is_gap = length == CycleMonitor::Length::gap;
    if (length == CycleMonitor::Length::silent) {
        // otherwise the supervisor has reported it
        if (declare_hung()) {
            raise(event(HAL_FAULT_SILENT_THREAD));
        }
    } else if (!is_gap && !in_budget && in_budget_ && !monitor.hung()) {
        board_.begin(this, &in_budget_);
        raise(event(HAL_FAULT_BUDGET));
    } else if (in_budget && !in_budget_) {
        board_.end(this, &in_budget_);
    }
    in_budget_ = in_budget;  // a row of overruns is one fault
    return now_ns;
}

void Core::make_safe() noexcept {
    if (!safe_) {
        safe_number_ = info_.number;
    }
    safe_ = true;
    if (!plan_ || stopped_.in_copy()) return;
    for (const plan::Safe& safe : plan_->safe) {
        __atomic_store_n(&safe.pin->slot->raw, safe.value.raw, __ATOMIC_RELAXED);
    }
    // a repetition at the end of the machine has the same number: no function has run in between
    hal_cycle info = info_;
    info.number = safe_number_;
    in_emergency_ = true;
    for (const plan::Step& step : plan_->emergency) {
        step.step(step.self, &info);
    }
    in_emergency_ = false;
}

void Core::make_safe_at_end() noexcept {
    const Current current(this);
    for (int free = nobody; !turn_.compare_exchange_weak(free, thread, std::memory_order_acq_rel);
         free = nobody) {
        sched_yield();
    }
    make_safe();
    turn_.store(nobody, std::memory_order_release);
}

void Core::woke_late(std::int64_t due_ns, std::int64_t now_ns) noexcept {
    const std::int64_t silent_ns = monitor.silence_before(due_ns, now_ns);
    if (silent_ns == 0 || !declare_hung()) return;
    raise({HAL_FAULT_SILENT_THREAD, 0, info_.number, info_.start_ns, static_cast<double>(silent_ns),
           nullptr, nullptr});
}

bool Core::declare_hung() noexcept {
    if (!monitor.declare_hung()) return false;
    board_.begin(this, &stopped_);
    stopped_.store(true, std::memory_order_release);
    return true;
}

void Core::stand_in(std::int64_t now_ns, bool emergency) noexcept {
    int free = nobody;
    const bool mine = turn_.compare_exchange_strong(free, supervisor, std::memory_order_acq_rel);
    if (plan::Plan* const plan = shown_.load(std::memory_order_acquire)) {
        for (const plan::Safe& safe : plan->safe) {
            __atomic_store_n(&safe.pin->slot->raw, safe.value.raw, __ATOMIC_RELAXED);
        }
        __atomic_store_n(&pins_.missed->slot->u32,
                         static_cast<std::uint32_t>(monitor.missed_by(now_ns)), __ATOMIC_RELAXED);
        if (emergency) {
            hal_cycle info{};
            info.size = sizeof info;
            info.period_ns = period_ns_;
            info.period_s = static_cast<double>(period_ns_) * 1e-9;
            info.start_ns = now_ns;
            info.number = monitor.cycles();
            for (const plan::Step& step : plan->emergency) {
                step.step(step.self, &info);
            }
        }
        if (mine) {
            publish(*plan);
        }
    }
    if (mine) {
        turn_.store(nobody, std::memory_order_release);
    }
}

std::uint32_t Core::current_function() const noexcept { return function_of(plan_, mark_->current); }

std::uint32_t Core::interrupted_function() const noexcept {
    return in_function() ? function_of(shown_.load(std::memory_order_acquire), newest_step(*mark_))
                         : 0;
}

std::uint32_t Core::hung_function() const noexcept {
    return monitor.busy_since_ns() != 0 ? interrupted_function() : 0;
}

/// Where the newest sample of the cycle that woke at `woke_ns` found it; 0: that cycle has no
/// sample.
std::uint32_t Core::slow_function(std::int64_t woke_ns) const noexcept {
    return function_of(plan_, monitor.sampled_step(woke_ns));
}

void Core::raise(FaultEvent event) noexcept {
    event.time_ns = measure_ ? unnoted_clock_ns() : info_.start_ns;
    if (inputs_ && inputs_->replays()) {
        event.time_ns = inputs_->record().woke_ns;
    }
    board_.count(event, id_);
    // when full the newest is lost but counted
    limiter_.raise(event, [this](const FaultEvent& e) noexcept { faults_.push(e); });
}

void Core::note_fork() noexcept {
    raise({HAL_FAULT_VIOLATION, current_function(), info_.number, info_.start_ns, 0.0,
           violation::forked, nullptr});
}

void Core::note_outside_reading() noexcept {
    raise({HAL_FAULT_VIOLATION, current_function(), info_.number, info_.start_ns, 0.0,
           violation::read_outside, nullptr});
}

void Core::end_copy() noexcept {
    for (;;) {
        syscall(SYS_exit_group, 1);
    }
}

void Core::trace_frame(TraceEvent::Kind kind, std::uint32_t id, std::size_t bytes) noexcept {
    if (!tracing_ || !in_function()) return;
    const std::int64_t now_ns = unnoted_clock_ns();
    tracing_->put(kind, now_ns, now_ns, info_.number, id, bytes);
}

void Core::step_clock(std::int64_t ns) noexcept {
    if (in_function()) {
        timeline_.step(grid_ns_, ns);
    }
}

/// Takes the next ticket. In a re-execution, waits for the turn of the journaled one.
///   1. enter: inside + 1   2. ticket, overlaps if inside was > 0    3. reads the state if so
///   4. the function runs   5. ticket, overlaps if it is not the next one or inside > 1
///   6. reads the state if so   7. leave: inside - 1
/// A function that enters between 5 and 7 of another one overlaps, and reads the state that the
/// other one has left.
std::uint64_t Core::pass(plan::Gate& gate, bool enters, bool& overlaps) noexcept {
    if (inputs_->replays()) {
        const std::uint64_t word = inputs_->note(0);
        overlaps = (word & 1) != 0;
        inputs_->wait_for_turn(word >> 1, gate.state.covered());
        return word >> 1;
    }
    plan::GateCounters& counters = *gate.counters;
    const std::uint32_t others = enters ? counters.inside.fetch_add(1, std::memory_order_acq_rel)
                                        : counters.inside.load(std::memory_order_acquire) - 1;
    const std::uint64_t ticket = counters.tickets.fetch_add(1, std::memory_order_acq_rel);
    overlaps = others > 0 || (!enters && ticket != gate.entered + 1);
    inputs_->note(ticket << 1 | (overlaps ? 1 : 0));
    return ticket;
}

void Core::exchange(plan::SharedState& state) noexcept {
    if (inputs_->replays()) {
        state.read([this]() noexcept { return inputs_->note(0); }, inputs_->has_state());
    } else {
        state.write([this](std::uint64_t word) noexcept { inputs_->note(word); });
    }
}

void Core::enter(plan::Gate& gate) noexcept {
    if (!inputs_) return;
    bool overlaps = false;
    gate.entered = pass(gate, true, overlaps);
    gate.state.begin();
    if (overlaps) [[unlikely]] {
        exchange(gate.state);
    }
    const std::uint64_t progress = note(__atomic_load_n(gate.progress, __ATOMIC_RELAXED));
    __atomic_store_n(gate.seen_progress, progress, __ATOMIC_RELAXED);
}

void Core::leave(plan::Gate& gate) noexcept {
    if (!inputs_) return;
    bool overlaps = false;
    pass(gate, false, overlaps);
    const bool live = !inputs_->replays();
    if (live) {
        gate.state.look();
    }
    if (overlaps) [[unlikely]] {
        exchange(gate.state);
    }
    if (live) {
        gate.counters->inside.fetch_sub(1, std::memory_order_acq_rel);
    }
}

void enter_gate(void* self, const hal_cycle*) {
    auto& gate = *static_cast<plan::Gate*>(self);
    static_cast<Core*>(gate.core)->enter(gate);
}

void leave_gate(void* self, const hal_cycle*) {
    auto& gate = *static_cast<plan::Gate*>(self);
    static_cast<Core*>(gate.core)->leave(gate);
}

void check_finite(void* self, const hal_cycle* cycle) {
    auto& check = *static_cast<plan::FiniteCheck*>(self);
    if (const double value = check.pin->slot->real; !std::isfinite(value)) [[unlikely]] {
        __atomic_store_n(&check.pin->slot->raw, check.instead.raw, __ATOMIC_RELAXED);
        if (check.bad) return;
        check.bad = true;
        auto& core = *static_cast<Core*>(check.sink);
        core.not_finite(*check.pin, true);
        core.raise({HAL_FAULT_NOT_FINITE, check.pin_id, cycle->number, cycle->start_ns, value,
                    nullptr, check.pin});
    } else if (check.bad) [[unlikely]] {
        check.bad = false;
        static_cast<Core*>(check.sink)->not_finite(*check.pin, false);
    }
}

}  // namespace hal

void hal_trace_frame(unsigned kind, std::uint32_t id, std::size_t bytes) noexcept {
    if (hal::Core* const core = hal::Core::current()) {
        core->trace_frame(static_cast<hal::TraceEvent::Kind>(kind), id, bytes);
    }
}
