// SPDX-License-Identifier: MIT
// A transaction from its first edit to its commit or rollback.
#include "machine/transaction.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "machine/construct.hpp"
#include "machine/session.hpp"
#include "machine/state.hpp"
#include "model/check/check.hpp"

namespace hal {

Edit& SessionState::editing(Diagnostics& diagnostics) {
    if (!reserve) {
        reserve = std::make_unique<char[]>(1 << 20);
    }
    if (!edit) {
        edit = options.check_only ? std::make_unique<Edit>(model, absences)
                                  : std::make_unique<Edit>(model);
    }
    edit->diagnostics = &diagnostics;
    return *edit;
}

namespace {

void elaborate(Elaboration& on, const EditForm& form, const Command& plain) {
    on.edit.diagnostics = &on.diagnostics;
    on.edit.absences().begin(plain.span);
    std::vector<Token> args, counted;
    if (!plain.args.empty() && plain.args[0].text == "=") {  // NAME = VALUE
        args.push_back(plain.name);
        args.insert(args.end(), plain.args.begin() + 1, plain.args.end());
    } else {
        args = plain.args;
    }
    std::copy_if(args.begin(), args.end(), std::back_inserter(counted),
                 [&](const Token& t) { return !form.arrows || !is_arrow(t.text); });
    if (check_arity(form.usage, plain.name, counted, on.diagnostics)) {
        return form.elaborate(on, args);
    }
    // what it names may be missing because of this
    if (!args.empty()) {
        on.edit.absences().note(args[0].text);
    }
}

}  // namespace

void Transaction::apply(const EditForm& form, const Command& command, Diagnostics& diagnostics) {
    SessionState& s = *session_->state_;
    try {
        Edit& edit = s.editing(diagnostics);
        for (const auto& thread : s.model.threads) {
            if (const Core* const core = s.core(thread.get())) {
                thread->init_done = core->passed();
            }
        }
        Elaboration on{s.model,     edit,
                       s.plugins,   session_->sources,
                       diagnostics, s.auto_orders,
                       form.usage,  s.options.check_only,
                       this,        s.executor ? &s.executor->board().shared.faults : nullptr};
        for (const Command& plain : expand(command, diagnostics)) {
            ++s.commands;
            elaborate(on, form, plain);
        }
    } catch (const std::bad_alloc&) {
        s.out_of_memory(diagnostics);
    }
}

void SessionState::offer_names(Diagnostics& diagnostics) {
    try {
        diagnostics.offer([this](std::uint32_t group) {
            return names.get(model, static_cast<NameGroup>(group), ending);
        });
    } catch (const std::bad_alloc&) {  // then no names are offered
    }
}

void Transaction::when_committed(std::function<void()> action) {
    session_->state_->when_committed.push_back(std::move(action));
}

void Transaction::needs_threads() { session_->state_->needs_threads = true; }

void Transaction::roll_back() {
    if (!session_) return;
    SessionState& s = *std::exchange(session_, nullptr)->state_;
    s.when_committed.clear();
    s.needs_threads = false;
    if (s.edit) {
        s.withdraw();
    }
    s.when_committed.clear();  // what modules wanted while they were unloaded again
    s.open = false;
}

namespace {

// What may still be incomplete after a single shell line (net before addf) is checked for whole
// files only.
void check_all(const Model& model, bool whole, bool complete, bool open, Diagnostics& diagnostics) {
    check_periods(model, diagnostics);
    check_spread_pins(model, diagnostics);
    check_arrows(model, diagnostics);
    if (!whole) return;
    // a file that has looked at its values before its first addf is not complete yet
    const bool scheduled =
        std::any_of(model.threads.begin(), model.threads.end(),
                    [](const auto& thread) { return !thread->functions.empty(); });
    if ((complete || scheduled) && !open) {
        check_unthreaded_functions(model, Unthreaded::all, diagnostics);
    }
    check_cross_thread_io(model, diagnostics);
    check_stale_reads(model, diagnostics);
}

}  // namespace

bool Transaction::commit(Diagnostics& diagnostics) {
    if (!session_) throw std::logic_error("the transaction has ended already");
    Session& session = *std::exchange(session_, nullptr);
    SessionState& s = *session.state_;
    bool good = false;
    if (s.edit) {
        s.edit->absences().report(diagnostics);
    }
    try {
        if (std::exchange(s.needs_threads, false)) {
            s.all_answer(diagnostics);
        }
        good = !diagnostics.failed() && (!s.edit || s.carry_out(diagnostics));
    } catch (const std::bad_alloc&) {
        s.out_of_memory(diagnostics);
    }
    s.offer_names(diagnostics);  // also those that are rolled back now
    // Nothing runs under `hal check`: what could be made stays, so that the texts after this one
    // are checked against it.
    if (!good && s.edit && s.options.check_only) {
        s.close_edit();
    } else if (!good && s.edit) {
        s.withdraw(&diagnostics);
    }
    s.open = false;
    const auto actions = std::exchange(s.when_committed, {});
    if (good) {
        for (const auto& action : actions) {
            action();
        }
    }
    return good;
}

/// Forgets the messages that this check would have found but did not: they no longer hold.
void SessionState::forget_reported(const Diagnostics& found, bool whole) {
    if (reported.empty()) return;
    std::set<std::string_view> messages;
    for (const Diagnostic& one : found.all()) {
        messages.insert(one.message);
    }
    std::erase_if(reported, [&](const auto& entry) {
        return (whole || !entry.second) && !messages.contains(entry.first);
    });
}

namespace {

/// No thread runs these instances any more: their devices get their safe values, as on `stop`.
void make_abandoned_safe(const Model& model, const Edit& edit) noexcept {
    const hal_cycle none{
        .size = sizeof none, .pad = 0, .period_ns = 0, .period_s = 0.0, .start_ns = 0, .number = 0};
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

}  // namespace

/// Warns of the functions that this edit removed from their threads, also when it is a single
/// command, and each time that they are removed.
void SessionState::report_removed_functions(Diagnostics& diagnostics) {
    Diagnostics removed;
    check_unthreaded_functions(model, Unthreaded::removed, removed);
    for (const Diagnostic& one : removed.all()) {
        reported.insert_or_assign(one.message, true);
        diagnostics.add(one);
    }
}

bool SessionState::carry_out(Diagnostics& diagnostics) {
    if (!edit->structural() &&
        edit->pin_values.size() + edit->signal_values.size() <= Core::most_writes / 2) {
        if (!write_values(edit->pin_values, edit->signal_values, diagnostics)) return false;
        close_edit();
        return true;
    }
    apply_auto_order(model, *edit, auto_orders, diagnostics);
    Diagnostics found;
    const bool whole = commands > 1;
    check_all(model, whole, options.check_only, edit->absences().open(), found);
    forget_reported(found, whole);
    report_removed_functions(diagnostics);
    for (const Diagnostic& one : found.all()) {
        // a warning is printed once, not with every later edit
        if (reported.emplace(one.message, whole).second ||
            (one.severity == Severity::error && !options.check_only)) {
            diagnostics.add(one);
        }
    }
    if (diagnostics.failed()) return false;
    if (options.check_only) {  // no thread takes them
        for (const auto& [signal, value] : edit->signal_values) {
            signal->value = value;
        }
        close_edit();
        return true;
    }
    if (!all_answer(diagnostics)) return false;

    for (Instance* const instance : edit->added_instances()) {
        if (!instance->constructed || instance->started ||
            model.find_instance(instance->name) != instance) {
            continue;  // unloaded again in the same edit
        }
        if (const Failure why =
                start_instance(*instance, model, *executor, status, journal.for_plugins());
            !why.empty()) {
            diagnostics.error(Code::named(why.code).value_or(Code("start-failed")),
                              instance->loaded,
                              "'" + instance->name + "' (" + instance->component->name +
                                  ") cannot start: " + why.text,
                              "", why.help);
        }
    }
    if (diagnostics.failed()) return false;
    touched = true;
    edit->make_taken_safe();
    if (!start_replaced(diagnostics)) return false;
    if (!make_threads(diagnostics) || !end_threads(edit->removed().threads, diagnostics) ||
        !synchronise(diagnostics)) {
        return false;
    }
    stuck.clear();
    make_abandoned_safe(model, *edit);
    close_edit();
    return true;
}

// Values only: straight into the threads' queues, whatever the size of the machine.
bool SessionState::write_values(const Notes<Pin, hal_value>& pins,
                                const Notes<Signal, hal_value>& signals, Diagnostics& diagnostics) {
    std::vector<std::pair<Core*, std::vector<Write>>> rows;
    const auto write = [&](const Thread* thread, hal_value* to, hal_value value) {
        Core* const to_core = core(thread);
        if (!to_core) return;
        auto row = std::find_if(rows.begin(), rows.end(),
                                [&](const auto& one) { return one.first == to_core; });
        if (row == rows.end()) {
            row = rows.insert(row, {to_core, {}});
        }
        row->second.push_back({to, value});
    };
    for (const auto& [pin, value] : pins) {
        write(pin->home, pin->memory->slot, value);
    }
    for (const auto& [signal, value] : signals) {
        if (signal->cell) continue;
        if (signal->home) {
            write(signal->home, signal->slot, value);
        } else {
            for (const auto& [thread, copy] : signal->copies) {
                write(thread, copy, value);
            }
        }
    }
    for (const auto& [thread, one] : cores) {
        if (one->hung() && std::any_of(rows.begin(), rows.end(),
                                       [one = one](const auto& row) { return row.first == one; })) {
            hung_thread(*thread, *one, diagnostics);
        }
    }
    if (diagnostics.failed()) return false;
    if (!executor->write(rows, answer_timeout_ns)) {
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

void SessionState::out_of_memory(Diagnostics& diagnostics) {
    reserve.reset();
    diagnostics.error("out-of-memory", {}, "there is no memory left for this edit", "",
                      "the machine runs on as it was; 'ulimit -v' and 'ulimit -l' limit a process");
}

void SessionState::end_conditions(const Instance& instance) {
    const auto* const first = static_cast<const char*>(instance.memory);
    const std::size_t size =
        instance.component->plugin ? instance.component->plugin->instance_size : 0;
    executor->board().end_all(first, first + size);
}

namespace {

void note_functions_in_threads(Model& model) {
    for (const auto& component : model.components) {
        for (const auto& function : component->functions) {
            function->was_in_thread = function->thread != nullptr;
        }
    }
}

}  // namespace

// The transaction is over, one way or the other: what is no longer in the model goes.
void SessionState::close_edit() {
    if (edit->structural()) {
        note_functions_in_threads(model);
    }
    faults.collect();  // before the plugins whose words they use
    auto& removed = edit->removed();
    for (auto it = removed.instances.rbegin(); it != removed.instances.rend(); ++it) {
        destroy_instance(**it);
        end_conditions(**it);
    }
    auto& replaced = edit->replaced();
    for (auto one = replaced.rbegin(); one != replaced.rend(); ++one) {
        for (auto it = one->other->instances.rbegin(); it != one->other->instances.rend(); ++it) {
            destroy_instance(**it);
            end_conditions(**it);
        }
    }
    // another instance may soon be where theirs was
    if (!removed.instances.empty() || !replaced.empty()) {
        faults.close_rows();
    }
    edit.reset();
    auto_orders.clear();
    before.pins.clear();
    before.signals.clear();
    touched = false;
}

}  // namespace hal
