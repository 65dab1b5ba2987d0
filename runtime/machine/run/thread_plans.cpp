// SPDX-License-Identifier: MIT
#include "machine/run/thread_plans.hpp"

#include <algorithm>
#include <deque>
#include <map>
#include <stdexcept>

#include <sys/sysinfo.h>

#include "machine/report/cpu_occupant.hpp"
#include "machine/report/exit_observer.hpp"
#include "machine/report/journaled_calls.hpp"
#include "machine/run/execution_sink.hpp"
#include "machine/run/plan_adoption.hpp"
#include "machine/run/state.hpp"

namespace hal {
namespace {

/// Under SCHED_FIFO: the user's priority, or one that falls with the rate.
int fifo_priority(const ThreadOptions& options, int by_rate) {
    if (options.policy != Policy::fifo) return 0;
    if (options.priority) return options.priority;
    return std::max(by_rate, 1);
}

hal_value load(const hal_value* slot) {
    return {.raw = __atomic_load_n(&slot->raw, __ATOMIC_RELAXED)};
}

void leave_home(const std::vector<std::unique_ptr<Pin>>& pins, const Thread& thread) {
    for (const auto& pin : pins) {
        if (pin->home == &thread) {
            pin->home = nullptr;
        }
    }
}

/// The thread writes nothing any more: the session owns what it owned. Its last plan's image stays
/// until the swap.
void take_over(Model& model, Thread& thread) {
    for (const auto& signal : model.signals) {
        if (signal->home == &thread) {
            signal->value = *signal->slot;
            signal->home = nullptr;
            signal->slot = &signal->value;
        }
        std::erase_if(signal->copies, [&](const auto& copy) { return copy.first == &thread; });
    }
    for (const auto& component : model.components) {
        for (const auto& instance : component->instances) {
            leave_home(instance->pins, thread);
        }
        for (const auto& function : component->functions) {
            leave_home(function->pins, thread);
        }
    }
    for (const auto& pin : thread.pins) {
        pin->home = nullptr;
    }
}

bool is_in_model(const Model& model, const Thread* thread) {
    return std::ranges::any_of(model.threads, [&](const auto& one) { return one.get() == thread; });
}

/// Returns true if an instance uses its pins in threads of its own.
bool has_own_threads(const Model& model) {
    return std::ranges::any_of(model.components, [](const auto& component) {
        return std::ranges::any_of(component->instances,
                                   [](const auto& instance) { return instance->own_threads; });
    });
}

void collect_cells(const std::vector<std::unique_ptr<Signal>>& signals,
                   std::vector<std::shared_ptr<void>>& cells) {
    for (const auto& signal : signals) {
        if (signal->cell) {
            cells.push_back(signal->cell);
        }
    }
}

/// What is written to each thread.
class WriteRows {
public:
    explicit WriteRows(const ThreadPlans& threads) : threads_(threads) {}
    /// Does nothing without a thread.
    void add(const Thread* thread, hal_value* to, hal_value value) {
        Core* const core = threads_.core(thread);
        if (!core) return;
        auto row = std::ranges::find(rows_, core, &Row::first);
        if (row == rows_.end()) {
            row = rows_.insert(row, {core, {}});
        }
        row->second.push_back({to, value});
    }
    void add(const Signal& signal, hal_value value) {
        if (signal.cell) return;
        if (signal.home) return add(signal.home, signal.slot, value);
        for (const auto& [thread, copy] : signal.copies) {
            add(thread, copy, value);
        }
    }
    using Row = std::pair<Core*, std::vector<Write>>;
    std::vector<Row>& rows() { return rows_; }

private:
    const ThreadPlans& threads_;
    std::vector<Row> rows_;
};

}  // namespace

void EarlierValues::note(const Edit& edit) {
    for (const auto& [pin, unused] : edit.pin_values) {
        if (pin->home) {
            pins.try_emplace(pin, load(edit.present(*pin).slot));
        }
    }
    for (const auto& [signal, unused] : edit.signal_values) {
        signals.try_emplace(signal, load(signal->slot));
    }
    for (const auto& [signal, unused] : edit.inherited) {
        signals.try_emplace(signal, load(signal->slot));
    }
}

void EarlierValues::clear() {
    pins.clear();
    signals.clear();
}

Core* ThreadPlans::core(const Thread* thread) const {
    const auto at = cores_.find(thread);
    return at == cores_.end() ? nullptr : at->second;
}

// --- threads ---

bool ThreadPlans::make(Diagnostics& diagnostics) {
    if (state_.options.check_only) return true;
    // priorities fall with the rate, from 98 as LinuxCNC has it
    int by_rate = 98;
    for (const auto& thread : state_.model.threads) {
        const int priority = fifo_priority(thread->options, by_rate);
        --by_rate;
        if (Core* const there = core(thread.get())) {
            state_.executor->set_priority(*there, priority);
        } else if (!add(*thread, priority, diagnostics)) {
            return false;
        }
    }
    return true;
}

bool ThreadPlans::add(Thread& thread, int priority, Diagnostics& diagnostics) {
    const ThreadOptions& o = thread.options;
    const SessionOptions& options = state_.options;
    CoreOptions wanted{o.period_ns,
                       o.cpu,
                       priority,
                       o.policy == Policy::deadline,
                       o.spin_ns,
                       o.budget_ns,
                       o.supervision_limit_ns(),
                       o.profile_every,
                       options.max_gap_ns,
                       options.max_gap_realtime_ns,
                       thread.name};
    const ThreadPins pins{&thread.time, &thread.tmax,   &thread.tmax_increased,
                          &thread.beat, &thread.missed, &thread.wakeup};
    if (options.observer) {
        wanted.mark = options.observer->take_mark();
    }
    if (options.sink || options.schedule) {
        prepare_journaled_calls();
    }
    if (options.sink) {
        wanted.inputs =
            options.sink->thread_made(thread.name, o.period_ns, state_.executor->next_id());
    }
    Core*& entry = cores_.try_emplace(&thread, nullptr).first->second;
    try {
        entry = &state_.executor->add(wanted, pins);
    } catch (const std::runtime_error& e) {
        cores_.erase(&thread);
        if (options.observer) {
            options.observer->give_back(wanted.mark);
        }
        diagnostics.error("thread-refused", thread.made,
                          "thread '" + thread.name + "' cannot be created: " + e.what());
        return false;
    } catch (const std::bad_alloc&) {
        cores_.erase(&thread);
        throw;
    }
    warn_of_missing_cpu(thread, *entry, diagnostics);
    return true;
}

/// A thread that this machine cannot bind as its netlist has it runs all the same.
void ThreadPlans::warn_of_missing_cpu(const Thread& thread, const Core& core,
                                      Diagnostics& diagnostics) const {
    const int wanted = thread.options.cpu;
    const bool may_be_bound = wanted >= 0 && thread.options.policy != Policy::deadline;
    if (!may_be_bound || state_.executor->is_virtual()) return;
    if (state_.executor->granted(core).cpu == wanted) return;
    const int count = get_nprocs_conf();
    const std::string cpu = "CPU " + std::to_string(wanted);
    std::string why = cpu + " is offline, or outside the cpuset of this process";
    std::string help = "to list the CPUs that are online, type: lscpu -e; or omit cpu=";
    if (wanted >= count) {
        why = "this machine has no " + cpu;
        help = "write a cpu= from 0 to " + std::to_string(count - 1) + ", or omit it";
    }
    diagnostics.warning("ignored-option", thread.made,
                        "thread '" + thread.name + "' is not bound to a CPU: " + why, "", help);
}

bool ThreadPlans::end(std::vector<std::unique_ptr<Thread>>& threads, Diagnostics& diagnostics) {
    for (const auto& thread : threads) {
        Core* const leaving = core(thread.get());
        if (leaving && !end(*thread, *leaving, diagnostics)) return false;
    }
    return true;
}

bool ThreadPlans::end(Thread& thread, Core& leaving, Diagnostics& diagnostics) {
    const CycleMark* const mark = leaving.mark();
    state_.faults.collect(thread);
    if (leaving.monitor.hung()) {
        report_hung(thread, leaving, diagnostics);
        return false;
    }
    if (!state_.executor->remove(leaving, answer_timeout_ns)) {
        if (leaving.monitor.hung()) {
            report_hung(thread, leaving, diagnostics);
        } else {
            diagnostics.error(
                "silent-thread", thread.made,
                "thread '" + thread.name + "' does not end: one of its functions hangs");
        }
        return false;
    }
    if (state_.options.observer) {
        state_.options.observer->give_back(mark);
    }
    cores_.erase(&thread);
    take_over(state_.model, thread);
    return true;
}

bool ThreadPlans::end_orphans() {
    std::vector<const Thread*> orphans;
    for (const auto& [thread, core] : cores_) {
        if (!is_in_model(state_.model, thread)) {
            orphans.push_back(thread);
        }
    }
    bool all_ended = true;
    for (const Thread* const thread : orphans) {
        if (state_.executor->remove(*cores_[thread], answer_timeout_ns)) {
            cores_.erase(thread);
        } else {
            all_ended = false;
        }
    }
    return all_ended;
}

bool ThreadPlans::end_all() {
    bool all_ended = true;
    for (const auto& [thread, core] : cores_) {
        if (state_.executor->remove(*core, answer_timeout_ns)) continue;
        state_.executor->abandon(*core);
        all_ended = false;
    }
    if (all_ended) {
        cores_.clear();
    }
    return all_ended;
}

// --- threads that do not answer ---

// Nothing may have changed when a thread turns out to hang, so this is seen first.
bool ThreadPlans::all_answer(Diagnostics& diagnostics) {
    const std::vector<Core*> hang = state_.executor->hanging(answer_timeout_ns);
    for (const Core* const one : hang) {
        report_silent(one, diagnostics);
    }
    return hang.empty();
}

void ThreadPlans::report_silent(const Core* silent, Diagnostics& diagnostics) const {
    const auto found = std::ranges::find(cores_, silent, &Cores::value_type::second);
    if (found == cores_.end()) return;
    const Thread& thread = *found->first;
    if (silent->monitor.hung()) return report_hung(thread, *silent, diagnostics);
    if (report_starved(thread, *silent, diagnostics)) return;
    diagnostics.error("silent-thread", thread.made,
                      "thread '" + thread.name + "' did not answer within " +
                          format_duration(static_cast<double>(answer_timeout_ns)) +
                          ": one of its functions hangs, or it gets no CPU time",
                      "", "see: show thread, show fault");
}

/// Reports a thread that is ready to run without CPU time. Returns false when it is not one.
bool ThreadPlans::report_starved(const Thread& thread, const Core& core,
                                 Diagnostics& diagnostics) const {
    if (!state_.executor->supervisor().starved(core)) return false;
    const std::string silent =
        format_duration(static_cast<double>(monotonic_ns() - core.monitor.finished_ns()));
    const int cpu = state_.executor->granted(core).cpu;
    const std::string rival = rival_of(core, cpu);
    const std::string by_rival =
        rival + " of this machine uses CPU " + std::to_string(cpu) +
        ": let it do less, or bind one of them to another CPU with cpu=N of newthread";
    diagnostics.error("starved-thread", thread.made,
                      "thread '" + thread.name + "' is ready to run, but has got no CPU time" +
                          (cpu >= 0 ? " on CPU " + std::to_string(cpu) : "") + " for " + silent,
                      core.monitor.hung() ? "its outputs are at their safe values" : "",
                      rival.empty() ? starvation_help(cpu) : by_rival);
    return true;
}

/// Returns "thread 'fast'": a thread of the machine that uses the CPU of this one; "": another
/// process does, or nothing is known.
std::string ThreadPlans::rival_of(const Core& core, int cpu) const {
    if (cpu < 0) return "";
    Supervisor& supervisor = state_.executor->supervisor();
    const Core* rival = supervisor.rival_of(core, true);
    // one that is between two cycles just now
    if (!rival && cpu_occupant(cpu).empty()) {
        rival = supervisor.rival_of(core, false);
    }
    const auto found = std::ranges::find(cores_, rival, &Cores::value_type::second);
    return found == cores_.end() ? "" : "thread '" + found->first->name + "'";
}

void ThreadPlans::report_hung(const Thread& thread, const Core& core,
                              Diagnostics& diagnostics) const {
    if (report_starved(thread, core, diagnostics)) return;
    const std::uint32_t id = core.hung_function();
    const LoadedFunction* const function = id != 0 ? function_with_id(state_.model, id) : nullptr;
    if (state_.executor->supervisor().ended(core)) {
        const std::string who = function ? function_text(*function) : "a function";
        diagnostics.error("hung-thread", thread.made,
                          "thread '" + thread.name + "' has ended: " + who + " ended it",
                          "its outputs are at their safe values",
                          "end the machine: the thread cannot be started again");
        return;
    }
    const std::string silent =
        format_duration(static_cast<double>(monotonic_ns() - core.monitor.finished_ns()));
    diagnostics.error("hung-thread", thread.made,
                      "thread '" + thread.name + "' has not finished a cycle for " + silent +
                          (function ? ": " + function_text(*function) + " does not return" : ""),
                      "its outputs are at their safe values",
                      "see: show fault; a function that never returns ends only with the process");
}

// --- plans ---

bool ThreadPlans::synchronise(Edit& edit, EarlierValues& before, Diagnostics& diagnostics) {
    const Functions later = deferred(edit, state_.model);
    if (!later.empty() && !swap(edit, before, later, diagnostics)) return false;
    return swap(edit, before, {}, diagnostics);
}

ThreadPlans::Functions ThreadPlans::deferred(Edit& edit, const Model& model) {
    Functions all = moving(model);
    all.merge(late_functions(state_handovers(edit)));
    return all;
}

/// Adds the handovers of instances that one thread runs to its plan. Returns the others: no thread
/// runs the instance.
std::vector<StateHandover> ThreadPlans::hand_over_in_threads(Edit& edit, const Functions& without,
                                                             Compiled& compiled) const {
    std::vector<StateHandover> by_session;
    for (StateHandover& one : state_handovers(edit)) {
        const Thread* runs = nullptr;
        for (const LoadedFunction* const function : one.instance->functions) {
            if (function->thread && !function->halted && !without.contains(function)) {
                runs = function->thread;
            }
        }
        const auto found = std::ranges::find_if(
            compiled.plans, [&](const auto& entry) { return entry.first == runs; });
        if (found == compiled.plans.end() || !core(runs)) {
            by_session.push_back(std::move(one));
            continue;
        }
        plan::Plan& plan = *found->second;
        plan.handovers.insert(plan.handovers.end(), one.copies.begin(), one.copies.end());
        plan.handed.push_back(one.handed);
        for (const LoadedFunction* const function : one.instance->functions) {
            const Core* const other = function->thread == runs ? nullptr : core(function->thread);
            if (other) {
                plan.after.push_back(other->precedence(plan.epoch));
            }
        }
    }
    return by_session;
}

bool ThreadPlans::swap(Edit& edit, EarlierValues& before, const Functions& without,
                       Diagnostics& diagnostics) {
    CompileInput input;
    input.epoch = ++epoch_;
    input.without = &without;
    input.pin_values = &edit.pin_values;
    input.signal_values = &edit.signal_values;
    input.inherited = &edit.inherited;
    input.old_memory = &edit.old_memory;
    input.core_of = [this](const Thread& thread) -> void* { return core(&thread); };
    input.check_finite = check_finite;
    input.gate = state_.executor->gate();
    input.enter_gate = enter_gate;
    input.leave_gate = leave_gate;
    Compiled compiled = compile(state_.model, input);
    state_.probes.enter(compiled);
    observe_unknowns(compiled);
    const std::vector<StateHandover> handovers = hand_over_in_threads(edit, without, compiled);
    before.note(edit);

    std::vector<std::shared_ptr<void>> cells;
    collect_cells(state_.model.signals, cells);
    collect_cells(edit.removed().signals, cells);
    left_cells_.reserve(left_cells_.size() + cells.size());
    std::vector<std::pair<Core*, plan::Plan*>> offers;
    stuck_.reserve(stuck_.size() + 2 * compiled.plans.size());
    for (auto& [thread, plan] : compiled.plans) {
        if (!core(thread)) continue;
        offers.emplace_back(core(thread), plan.get());
        plans_.try_emplace(thread);
    }
    std::ranges::stable_partition(offers,
                                  [](const auto& offer) { return offer.second->after.empty(); });
    std::unordered_set<const Core*> dependent;  // they wait for others
    for (const auto& [core, plan] : offers) {
        if (!plan->after.empty()) {
            dependent.insert(core);
        }
    }
    std::vector<Core*> silent;
    const std::function<bool(const Thread*)> hangs = [&](const Thread* thread) {
        return thread && std::ranges::find(silent, core(thread)) != silent.end();
    };
    // from here until the plans are kept nothing is allocated
    silent = state_.executor->swap(offers, answer_timeout_ns);
    if (silent.empty() && without.empty()) {
        std::ranges::for_each(handovers, hand_over);
    }
    PlanAdoption(edit, compiled, hangs, silent.empty()).adopt();
    for (auto& [thread, plan] : compiled.plans) {
        std::unique_ptr<plan::Plan>& running = plans_.at(thread);
        if (!silent.empty()) {
            stuck_.push_back(std::move(hangs(thread) ? plan : running));
        }
        if (!hangs(thread)) {
            running = std::move(plan);
        }
    }
    // a thread that could not be ended runs its plan when it gets CPU time again
    std::erase_if(plans_, [&](const auto& entry) {
        return !is_in_model(state_.model, entry.first) && !core(entry.first);
    });
    if (state_.options.observer) {
        describe_functions();
    }
    keep_cells(cells, silent.empty());
    for (const Core* const one : silent) {
        if (silent.size() == 1 || !dependent.contains(one)) {
            report_silent(one, diagnostics);
        }
    }
    return silent.empty();
}

/// Every thread that answered has begun a cycle since the swap before, so nobody looks into that
/// one's cells any more except for threads of modules' own, which do not answer: while there are
/// any, all cells stay.
void ThreadPlans::keep_cells(const std::vector<std::shared_ptr<void>>& cells, bool all_answered) {
    const bool own_threads = has_own_threads(state_.model);
    if (all_answered && !own_threads) {
        left_cells_.clear();
    }
    left_cells_.insert(left_cells_.end(), cells.begin(), cells.end());
    if (own_threads) {
        std::sort(left_cells_.begin(), left_cells_.end());
        left_cells_.erase(std::unique(left_cells_.begin(), left_cells_.end()), left_cells_.end());
    }
}

void ThreadPlans::describe_functions() {
    for (const auto& [thread, plan] : plans_) {
        // a thread that did not answer the swap for its first plan has none
        if (const Core* const of = core(thread); of && plan) {
            state_.options.observer->describe(of->mark(), *thread, *plan);
        }
    }
}

// Values that another thread owns: one coherent look into each such thread.
void ThreadPlans::observe_unknowns(Compiled& compiled) {
    std::map<Core*, std::vector<Compiled::Unknown*>> by_owner;
    for (auto& unknown : compiled.unknowns) {
        if (Core* const owner = core(unknown.owner)) {
            by_owner[owner].push_back(&unknown);
        } else {
            unknown.carry->value = *unknown.from;
        }
    }
    std::deque<Observation> observations;
    std::deque<std::vector<const hal_value*>> from;
    std::deque<std::vector<hal_value>> to;
    std::vector<std::pair<Core*, Observation*>> requests;
    for (const auto& [owner, unknowns] : by_owner) {
        auto& sources = from.emplace_back();
        for (const auto* unknown : unknowns) {
            sources.push_back(unknown->from);
        }
        auto& values = to.emplace_back(unknowns.size());
        Observation& request = observations.emplace_back();
        request.from = sources.data();
        request.to = values.data();
        request.count = sources.size();
        request.number = epoch_;
        requests.emplace_back(owner, &request);
    }
    if (requests.empty()) return;
    state_.executor->observe(requests, answer_timeout_ns);
    std::size_t i = 0;
    for (const auto& [owner, unknowns] : by_owner) {
        for (std::size_t k = 0; k < unknowns.size(); ++k) {
            unknowns[k]->carry->value = to[i][k];
        }
        ++i;
    }
}

// --- values ---

/// Returns true when a thread that is to take values hangs.
bool ThreadPlans::report_hung_writers(const std::vector<std::pair<Core*, std::vector<Write>>>& rows,
                                      Diagnostics& diagnostics) const {
    bool any = false;
    for (const auto& [thread, core] : cores_) {
        if (core->monitor.hung() &&
            std::ranges::find(rows, core, &WriteRows::Row::first) != rows.end()) {
            report_hung(*thread, *core, diagnostics);
            any = true;
        }
    }
    return any;
}

bool ThreadPlans::write(const Notes<Pin, hal_value>& pins, const Notes<Signal, hal_value>& signals,
                        Diagnostics& diagnostics) {
    WriteRows rows(*this);
    for (const auto& [pin, value] : pins) {
        rows.add(pin->home, pin->memory->slot, value);
    }
    for (const auto& [signal, value] : signals) {
        rows.add(*signal, value);
    }
    if (report_hung_writers(rows.rows(), diagnostics) || diagnostics.failed()) return false;
    if (!state_.executor->write(rows.rows(), answer_timeout_ns)) {
        diagnostics.error("silent-thread", {},
                          "a thread did not take the new value: one of its functions hangs", "",
                          "see: show thread, show fault");
        return false;
    }
    for (const auto& [signal, value] : signals) {
        if (signal->cell) {
            __atomic_store_n(&signal->cell->raw, value.raw, __ATOMIC_RELAXED);
        } else if (!signal->home) {
            signal->value = value;
        }
    }
    return true;
}

}  // namespace hal
