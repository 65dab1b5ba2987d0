// SPDX-License-Identifier: MIT
#include "machine/run/open_transaction.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "base/keep.hpp"
#include "machine/load/construct.hpp"
#include "machine/run/execution_sink.hpp"
#include "machine/run/replaced_instances.hpp"
#include "machine/run/state.hpp"

namespace hal {
namespace {

/// No thread runs these instances any more: their devices get their safe values, as on `stop`.
void make_abandoned_safe(const Model& model, const Edit& edit) noexcept {
    hal_cycle none{};
    none.size = sizeof none;
    const auto runs = [](const LoadedFunction* function) { return function->thread != nullptr; };
    for (const LoadedFunction* const function : edit.taken_functions()) {
        for (const Instance* const instance : function->instances) {
            const bool is_loaded = model.find_instance(instance->name) == instance;
            if (!is_loaded || !instance->started ||
                std::any_of(instance->functions.begin(), instance->functions.end(), runs)) {
                continue;
            }
            for (const plan::Step& step : instance->emergency) {
                step.step(step.self, &none);
            }
        }
    }
}

/// What the check of the next transaction compares with.
void note_committed(Model& model) {
    for (const auto& component : model.components) {
        for (const auto& function : component->functions) {
            function->was_in_thread = function->thread != nullptr;
        }
    }
    for (const auto& signal : model.signals) {
        signal->had_writer = signal->writer != nullptr;
    }
}

/// Destroys instances in the reverse order of their creation.
void destroy(const std::vector<std::unique_ptr<Instance>>& instances, SessionState& state) {
    for (auto it = instances.rbegin(); it != instances.rend(); ++it) {
        state.destroy(**it);
        end_conditions(*state.executor, **it);
    }
}

}  // namespace

void OpenTransaction::begin() {
    if (open_) throw std::logic_error("a transaction is open already");
    open_ = true;
    starts_ = false;
    is_rejected_ = false;
    commands_ = 0;
    words_.clear();
}

Edit& OpenTransaction::editing(Diagnostics& diagnostics) {
    if (!reserve_) {
        reserve_ = std::make_unique<char[]>(1 << 20);
    }
    if (!edit_) {
        edit_ = state_.options.check_only ? std::make_unique<Edit>(state_.model, state_.absences)
                                          : std::make_unique<Edit>(state_.model);
    }
    edit_->diagnostics = &diagnostics;
    return *edit_;
}

void OpenTransaction::out_of_memory(Diagnostics& diagnostics) {
    reserve_.reset();
    diagnostics.error("out-of-memory", {}, "there is no memory left for this edit", "",
                      "the machine runs on as it was; 'ulimit -v' and 'ulimit -l' limit a process");
}

void OpenTransaction::abandon() {
    actions_.clear();
    needs_threads_ = false;
    if (edit_) {
        withdraw(nullptr, state_.threads.epoch());
    }
}

void OpenTransaction::roll_back() {
    abandon();
    actions_.clear();  // what modules wanted while they were unloaded again
    open_ = false;
}

bool OpenTransaction::commit(Diagnostics& diagnostics) {
    if (edit_) {
        edit_->absences().report(diagnostics);
    }
    const std::uint64_t epoch = state_.threads.epoch();
    const bool edits = edit_ != nullptr;
    bool good = false;
    try {
        if (std::exchange(needs_threads_, false)) {
            state_.threads.all_answer(diagnostics);
        }
        good = !diagnostics.failed() && (!edit_ || carry_out(diagnostics));
    } catch (const std::bad_alloc&) {
        out_of_memory(diagnostics);
    }
    state_.offer_names(diagnostics);  // also those that are rolled back now
    // Nothing runs under `hal check`: what could be made stays, so that the texts after this one
    // are checked against it.
    if (!good && edit_ && state_.options.check_only) {
        close_edit();
    } else if (!good && edit_) {
        withdraw(&diagnostics, epoch);
    }
    open_ = false;
    if (good && edits) {
        journal(epoch);
    }
    const auto actions = std::exchange(actions_, {});
    if (good) {
        for (const auto& action : actions) {
            action();
        }
    }
    return good;
}

void OpenTransaction::start_and_reject(Diagnostics& diagnostics) {
    is_rejected_ = true;
    commit(diagnostics);
}

/// `epoch`: of the last plan before the edit.
JournaledTransaction OpenTransaction::journaled(std::uint64_t epoch) {
    return {.epoch = epoch,
            .commands = std::exchange(words_, {}),
            .starts = starts_,
            .calls = state_.setup->ordered_calls()};
}

void OpenTransaction::journal(std::uint64_t epoch) noexcept {
    if (!state_.options.sink) return;
    try {
        JournaledTransaction noted = journaled(epoch);
        state_.setup->flush(*state_.options.sink);
        state_.options.sink->edited(std::move(noted), state_.model);
    } catch (const std::bad_alloc&) {
        // The edit has taken effect. The re-execution ends where the first cycle needs it.
    }
}

bool OpenTransaction::carry_out(Diagnostics& diagnostics) {
    const std::size_t values = edit_->pin_values.size() + edit_->signal_values.size();
    if (!edit_->structural() && values <= Core::max_writes / 2 && !is_rejected_) {
        if (!state_.threads.write(edit_->pin_values, edit_->signal_values, diagnostics)) {
            return false;
        }
        close_edit();
        return true;
    }
    apply_auto_order(state_.model, *edit_, auto_orders_, diagnostics);
    checks_.run(state_.model,
                {.whole = commands_ > 1,
                 .complete = state_.options.check_only,
                 .open = edit_->absences().open()},
                diagnostics);
    if (diagnostics.failed()) return false;
    if (state_.options.check_only) {  // no thread takes them
        for (const auto& [signal, value] : edit_->signal_values) {
            signal->value = value;
        }
    } else if (!carry_out_checked(diagnostics)) {
        return false;
    }
    close_edit();
    return true;
}

/// Starts new instances, and gives the threads their new plans.
bool OpenTransaction::carry_out_checked(Diagnostics& diagnostics) {
    ThreadPlans& threads = state_.threads;
    if (!threads.all_answer(diagnostics)) return false;
    starts_ = true;
    if (!start_added(diagnostics) || is_rejected_) return false;
    touched_ = true;
    edit_->make_taken_safe();
    if (!ReplacedInstances(state_, *edit_, before_).start(diagnostics)) return false;
    if (!threads.make(diagnostics)) return false;
    if (!threads.end(edit_->removed().threads, diagnostics)) return false;
    if (!threads.synchronise(*edit_, before_, diagnostics)) return false;
    if (threads.end_orphans()) {  // they may run one of these plans
        threads.free_stuck();
    }
    make_abandoned_safe(state_.model, *edit_);
    return true;
}

bool OpenTransaction::start_added(Diagnostics& diagnostics) {
    for (Instance* const instance : edit_->added_instances()) {
        if (!instance->constructed || instance->started) continue;
        // unloaded again in the same edit
        if (state_.model.find_instance(instance->name) != instance) continue;
        const Failure why = state_.start(*instance);
        if (why.empty()) continue;
        diagnostics.error(failure_code(why.code, "start-failed"), instance->loaded,
                          "'" + instance->name + "' (" + instance->component->name +
                              ") cannot start: " + why.text,
                          "", why.help);
    }
    return !diagnostics.failed();
}

/// Undoes the transaction, in the model and in threads that have taken it. `epoch`: of the last plan
/// before it.
void OpenTransaction::withdraw(Diagnostics* diagnostics, std::uint64_t epoch) {
    const bool is_taken = touched_;
    edit_->undo();
    Diagnostics ignored;
    const bool is_undone = !touched_ || restore_threads(diagnostics ? *diagnostics : ignored);
    if (is_undone) {
        close_edit();
    } else {
        keep_for_good(std::move(edit_));  // a thread may still use what the edit made
        forget_edit();
    }
    if (is_taken) {
        journal_withdrawal(epoch, is_undone);
    } else if (state_.setup) {
        journal_rejection(epoch);
        state_.setup->forget();
    }
}

/// A bus in memory has seen the instances: the same edit is made, and rejected, again.
void OpenTransaction::journal_rejection(std::uint64_t epoch) noexcept {
    if (!state_.options.sink) return;
    try {
        JournaledTransaction noted = journaled(epoch);
        if (noted.calls.empty()) return;
        state_.setup->flush(*state_.options.sink);
        state_.options.sink->rejected(std::move(noted));
    } catch (const std::bad_alloc&) {
        // The re-execution ends where the first call behind it waits for one of its calls.
    }
}

/// The cycles of threads that have taken it, and again the plans before it, need the same edit.
void OpenTransaction::journal_withdrawal(std::uint64_t epoch, bool is_undone) noexcept {
    if (!state_.options.sink) return;
    try {
        JournaledTransaction noted = journaled(epoch);
        if (!is_undone) {
            noted.commands.clear();
        }
        state_.setup->flush(*state_.options.sink);
        state_.options.sink->withdrawn(std::move(noted));
    } catch (const std::bad_alloc&) {
        // The re-execution ends where the first cycle needs it.
    }
}

/// Threads that took the new plan take one of the old model again, with the values it had. Returns
/// false when a thread may still use the edit.
bool OpenTransaction::restore_threads(Diagnostics& diagnostics) {
    bool restored = state_.threads.end_orphans();
    edit_->pin_values = before_.pins;
    for (const auto& signal : state_.model.signals) {
        const auto value = before_.signals.find(signal.get());
        if (value != before_.signals.end()) {
            edit_->signal_values.insert(*value);
        }
    }
    try {
        Diagnostics ignored;
        ReplacedInstances(state_, *edit_, before_).restart(diagnostics);
        state_.threads.make(ignored);
        // a thread that does not take the old instances again may go on with the new ones
        if (!state_.threads.synchronise(*edit_, before_, ignored) && !edit_->replaced().empty()) {
            restored = false;
        }
    } catch (const std::bad_alloc&) {
        restored = false;
    }
    return restored;
}

/// The transaction is over, one way or the other: what is no longer in the model is destroyed.
void OpenTransaction::close_edit() {
    if (edit_->structural()) {
        note_committed(state_.model);
    }
    state_.faults.collect();  // before the plugins whose texts they use
    auto& removed = edit_->removed();
    destroy(removed.instances, state_);
    auto& replaced = edit_->replaced();
    for (auto one = replaced.rbegin(); one != replaced.rend(); ++one) {
        destroy(one->other->instances, state_);
    }
    // another instance may soon be where theirs was
    if (!removed.instances.empty() || !replaced.empty()) {
        state_.faults.close_rows();
    }
    forget_edit();
}

/// The next transaction begins without anything of this one.
void OpenTransaction::forget_edit() {
    edit_.reset();
    auto_orders_.clear();
    before_.clear();
    touched_ = false;
}

}  // namespace hal
