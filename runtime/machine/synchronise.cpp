// SPDX-License-Identifier: MIT
// From an edited model to threads that run it: steps 6 and 7 of docs/design.md.
#include <algorithm>
#include <stdexcept>

#include "base/keep.hpp"
#include "machine/construct.hpp"
#include "machine/exit_observer.hpp"
#include "machine/state.hpp"
#include "model/modules.hpp"

namespace hal {

Core* SessionState::core(const Thread* thread) const {
    const auto at = cores.find(thread);
    return at == cores.end() ? nullptr : at->second;
}

bool SessionState::make_threads(Diagnostics& diagnostics) {
    if (options.check_only) return true;
    // priorities fall with the rate, from 98 as LinuxCNC has it
    int priority = 98;
    for (const auto& thread : model.threads) {
        const ThreadOptions& o = thread->options;
        const int by_rate = o.policy != Policy::fifo ? 0
                            : o.priority             ? o.priority
                                                     : std::max(priority, 1);
        if (Core* const there = core(thread.get())) {
            executor->set_priority(*there, by_rate);
        } else {
            CoreOptions wanted{o.period_ns,
                               o.cpu,
                               by_rate,
                               o.policy == Policy::deadline,
                               o.spin_ns,
                               o.budget_ns,
                               o.supervision_limit_ns(),
                               o.profile_every,
                               options.max_gap_ns,
                               options.max_gap_realtime_ns,
                               thread->name};
            const ThreadPins pins{&thread->time, &thread->tmax,   &thread->tmax_increased,
                                  &thread->beat, &thread->missed, &thread->wakeup};
            if (options.observer) {
                wanted.mark = options.observer->take_mark();
            }
            Core*& place = cores.try_emplace(thread.get(), nullptr).first->second;
            try {
                place = &executor->add(wanted, pins);
            } catch (const std::runtime_error& e) {
                cores.erase(thread.get());
                if (options.observer) {
                    options.observer->give_back(wanted.mark);
                }
                diagnostics.error("thread-refused", thread->made,
                                  "thread '" + thread->name + "' cannot be created: " + e.what());
                return false;
            } catch (const std::bad_alloc&) {
                cores.erase(thread.get());
                throw;
            }
        }
        --priority;
    }
    return true;
}

bool SessionState::end_threads(std::vector<std::unique_ptr<Thread>>& threads,
                               Diagnostics& diagnostics) {
    for (const auto& owned : threads) {
        Thread* const thread = owned.get();
        Core* const leaving = core(thread);
        if (!leaving) continue;
        const CycleMark* const mark = leaving->mark();
        faults.collect(*thread);
        if (leaving->hung() || !executor->remove(*leaving, answer_timeout_ns)) {
            if (leaving->hung()) {
                hung_thread(*thread, *leaving, diagnostics);
                return false;
            }
            diagnostics.error(
                "silent-thread", thread->made,
                "thread '" + thread->name + "' does not end: one of its functions hangs");
            return false;
        }
        if (options.observer) {
            options.observer->give_back(mark);
        }
        cores.erase(thread);
        // it writes nothing any more: the session owns what it owned (its last plan's image stays
        // until the swap)
        for (const auto& signal : model.signals) {
            if (signal->home == thread) {
                signal->value = *signal->slot;
                signal->home = nullptr;
                signal->slot = &signal->value;
            }
            std::erase_if(signal->copies, [&](const auto& copy) { return copy.first == thread; });
        }
        for (const auto& component : model.components) {
            for (const auto& instance : component->instances) {
                for (const auto& pin : instance->pins) {
                    if (pin->home == thread) {
                        pin->home = nullptr;
                    }
                }
            }
            for (const auto& function : component->functions) {
                for (const auto& pin : function->pins) {
                    if (pin->home == thread) {
                        pin->home = nullptr;
                    }
                }
            }
        }
        for (const auto& pin : thread->pins) {
            pin->home = nullptr;
        }
    }
    return true;
}

// Nothing may have changed when a thread turns out to hang, so this is seen first.
bool SessionState::all_answer(Diagnostics& diagnostics) {
    const std::vector<Core*> hang = executor->hanging(answer_timeout_ns);
    for (const Core* const one : hang) {
        silent_thread(one, diagnostics);
    }
    return hang.empty();
}

void SessionState::silent_thread(const Core* hangs, Diagnostics& diagnostics) const {
    for (const auto& [thread, one] : cores) {
        if (one == hangs && one->hung()) {
            hung_thread(*thread, *one, diagnostics);
        } else if (one == hangs && !starved_thread(*thread, *one, diagnostics)) {
            diagnostics.error("silent-thread", thread->made,
                              "thread '" + thread->name + "' did not answer within " +
                                  format_duration(static_cast<double>(answer_timeout_ns)) +
                                  ": one of its functions hangs, or it gets no CPU time",
                              "", "see: show thread, show fault");
        }
    }
}

void SessionState::withdraw(Diagnostics* diagnostics) {
    edit->undo();
    bool in_step = true;
    if (touched) {
        Diagnostics ignored;
        // Threads that took the new plan take one of the old model again, with the values it had.
        std::vector<const Thread*> orphans;
        for (const auto& [thread, core] : cores) {
            if (std::none_of(model.threads.begin(), model.threads.end(),
                             [&, t = thread](const auto& one) { return one.get() == t; })) {
                orphans.push_back(thread);
            }
        }
        for (const Thread* const thread : orphans) {
            if (executor->remove(*cores[thread], answer_timeout_ns)) {
                cores.erase(thread);
            } else {
                in_step = false;
            }
        }
        edit->pin_values = before.pins;
        for (const auto& signal : model.signals) {
            if (const auto value = before.signals.find(signal.get());
                value != before.signals.end()) {
                edit->signal_values.insert(*value);
            }
        }
        try {
            restart_replaced(diagnostics ? *diagnostics : ignored);
            make_threads(ignored);
            // a thread that does not take the old instances again may go on with the new ones
            if (!synchronise(ignored) && !edit->replaced().empty()) {
                in_step = false;
            }
        } catch (const std::bad_alloc&) {
            in_step = false;
        }
    }
    // a thread may still use what the edit made: it stays for good
    if (!in_step) {
        keep_for_good(std::move(edit));
    } else {
        close_edit();
    }
}

bool SessionState::synchronise(Diagnostics& diagnostics) {
    // A function must never be in two threads at once: first everything runs without the movers,
    // then with them.
    if (const auto movers = moving(model); !movers.empty() && !swap(movers, diagnostics)) {
        return false;
    }
    return swap({}, diagnostics);
}

bool SessionState::swap(const std::unordered_set<const LoadedFunction*>& without,
                        Diagnostics& diagnostics) {
    CompileInput input;
    input.epoch = ++epoch;
    input.without = &without;
    input.pin_values = &edit->pin_values;
    input.signal_values = &edit->signal_values;
    input.inherited = &edit->inherited;
    input.old_memory = &edit->old_memory;
    input.core_of = [this](const Thread& thread) -> void* { return core(&thread); };
    input.check_finite = check_finite;
    Compiled compiled = compile(model, input);
    probes.enter(compiled);
    observe_unknowns(compiled);
    keep_values();

    std::vector<std::shared_ptr<void>> cells;
    const auto note_cells = [&](const auto& signals) {
        for (const auto& signal : signals) {
            if (signal->cell) {
                cells.push_back(signal->cell);
            }
        }
    };
    note_cells(model.signals);
    note_cells(edit->removed().signals);
    left_cells.reserve(left_cells.size() + cells.size());
    std::vector<std::pair<Core*, plan::Plan*>> offers;
    stuck.reserve(stuck.size() + 2 * compiled.plans.size());
    for (auto& [thread, plan] : compiled.plans) {
        if (!core(thread)) continue;
        offers.emplace_back(core(thread), plan.get());
        plans.try_emplace(thread);  // from here to the end of settle() nothing is allocated
    }
    const std::vector<Core*> silent = executor->swap(offers, answer_timeout_ns);
    settle(compiled, silent);
    if (options.observer) {
        describe_functions();
    }
    // every thread that answered has begun a cycle since the swap before, so nobody looks into that
    // one's cells any more except for threads of modules' own, which do not answer: while there are
    // any, all cells stay
    const bool own_threads = has_own_threads(model);
    if (silent.empty() && !own_threads) {
        left_cells.clear();
    }
    left_cells.insert(left_cells.end(), cells.begin(), cells.end());
    if (own_threads) {
        std::sort(left_cells.begin(), left_cells.end());
        left_cells.erase(std::unique(left_cells.begin(), left_cells.end()), left_cells.end());
    }
    for (const Core* const hangs : silent) {
        silent_thread(hangs, diagnostics);
    }
    return silent.empty();
}

void SessionState::describe_functions() {
    for (const auto& [thread, plan] : plans) {
        if (const Core* const of = core(thread)) {
            options.observer->describe(of->mark(), *thread, *plan);
        }
    }
}

void SessionState::keep_values() {
    const auto value = [](const hal_value* slot) {
        return hal_value{.raw = __atomic_load_n(&slot->raw, __ATOMIC_RELAXED)};
    };
    for (const auto& [pin, unused] : edit->pin_values) {
        if (pin->home) {
            before.pins.try_emplace(pin, value(edit->present(*pin).slot));
        }
    }
    for (const auto& [signal, unused] : edit->signal_values) {
        before.signals.try_emplace(signal, value(signal->slot));
    }
    for (const auto& [signal, unused] : edit->inherited) {
        before.signals.try_emplace(signal, value(signal->slot));
    }
}

// Values that another thread owns: one coherent look into each such thread.
void SessionState::observe_unknowns(Compiled& compiled) {
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
    std::vector<std::pair<Core*, Observation*>> wishes;
    for (const auto& [owner, unknowns] : by_owner) {
        auto& sources = from.emplace_back();
        for (const auto* unknown : unknowns) {
            sources.push_back(unknown->from);
        }
        auto& values = to.emplace_back(unknowns.size());
        Observation& wish = observations.emplace_back();
        wish.from = sources.data();
        wish.to = values.data();
        wish.count = sources.size();
        wishes.emplace_back(owner, &wish);
    }
    if (wishes.empty()) return;
    executor->observe(wishes, answer_timeout_ns);
    std::size_t i = 0;
    for (const auto& [owner, unknowns] : by_owner) {
        for (std::size_t k = 0; k < unknowns.size(); ++k) {
            unknowns[k]->carry->value = to[i][k];
        }
        ++i;
    }
}

// No thread uses the old instances of a reload, nor those that were unloaded: their pins stand
// alone, with the values they have, before the images they point into go.
void SessionState::retire() {
    const auto alone = [](const Pin& pin) {
        hal_pin& memory = *pin.memory;
        if (memory.slot == &memory.own) return;
        memory.own.raw =
            pin.type == HAL_TYPE_PORT ? 0 : __atomic_load_n(&memory.slot->raw, __ATOMIC_RELAXED);
        memory.slot = &memory.own;
        if (pin.pointer) {
            *pin.pointer = memory.slot;
        }
    };
    const auto all_alone = [&](const std::vector<std::unique_ptr<Instance>>& instances) {
        for (const auto& instance : instances) {
            for (const auto& pin : instance->pins) {
                alone(*pin);
            }
        }
    };
    all_alone(edit->removed().instances);
    for (const auto& one : edit->replaced()) {
        all_alone(one.other->instances);
    }
    edit->old_memory.clear();
}

// All threads that answered run the new plans; the old images are still there, and nobody writes
// them any more. A thread that did not answer still runs its old plan, so what is known of its
// places stays.
void SessionState::settle(Compiled& compiled, const std::vector<Core*>& silent) {
    const auto hangs = [&](const Thread* thread) {
        return thread && std::find(silent.begin(), silent.end(), core(thread)) != silent.end();
    };
    for (Compiled::Place& place : compiled.places) {
        Signal& signal = *place.signal;
        if (hangs(signal.home) || hangs(place.home)) continue;
        if (!place.home && !place.cell) {
            if (const auto set = edit->signal_values.find(&signal);
                set != edit->signal_values.end()) {
                signal.value = set->second;
            } else if (const auto from = edit->inherited.find(&signal);
                       from != edit->inherited.end()) {
                const auto pinned = edit->pin_values.find(from->second);
                signal.value = pinned != edit->pin_values.end()
                                   ? pinned->second
                                   : *edit->present(*from->second).slot;
            } else if (signal.cell) {
                signal.value.raw = __atomic_load_n(&signal.cell->raw, __ATOMIC_RELAXED);
            } else if (signal.home) {
                signal.value = *signal.slot;
            }
        } else if (place.cell) {
            if (const auto set = edit->signal_values.find(&signal);
                set != edit->signal_values.end()) {
                __atomic_store_n(&place.cell->raw, set->second.raw, __ATOMIC_RELAXED);
            }
        }
    }
    for (const auto& rebind : compiled.session_rebinds) {
        if (rebind.slot == &rebind.pin->own) {
            rebind.pin->own = rebind.keeps_value ? *rebind.from : hal_value{.raw = 0};
        }
        rebind.pin->slot = rebind.slot;
    }
    for (const auto& pointer : compiled.session_pointers) {
        *pointer.to = pointer.slot;
    }
    for (const auto& [pin, thread] : compiled.homes) {
        if (!hangs(pin->home) && !hangs(thread)) {
            pin->home = thread;
        }
    }
    for (Compiled::Place& place : compiled.places) {
        Signal& signal = *place.signal;
        const auto keep = [&](auto& copies, bool of_hanging) {
            std::erase_if(copies,
                          [&](const auto& copy) { return hangs(copy.first) != of_hanging; });
        };
        if (silent.empty()) {
            signal.copies = std::move(place.copies);
        } else {
            keep(place.copies, false);
            keep(signal.copies, true);
            signal.copies.insert(signal.copies.end(), place.copies.begin(), place.copies.end());
        }
        if (hangs(signal.home) || hangs(place.home)) continue;
        signal.home = place.home;
        signal.slot = place.slot;
        signal.cell = std::move(place.cell);
    }
    for (const auto& [pin, value] : edit->pin_values) {
        if (!pin->home && !pin->signal) {
            *pin->memory->slot = value;
        }
    }
    // the values have been taken; a second swap of the same edit must not give them again
    edit->pin_values.clear();
    edit->signal_values.clear();
    edit->inherited.clear();
    if (silent.empty()) {
        retire();
    }
    for (auto& [thread, plan] : compiled.plans) {
        std::unique_ptr<plan::Plan>& running = plans.at(thread);
        if (!silent.empty()) {
            stuck.push_back(std::move(hangs(thread) ? plan : running));
        }
        if (!hangs(thread)) {
            running = std::move(plan);
        }
    }
    std::erase_if(plans, [&](const auto& entry) {
        return std::none_of(model.threads.begin(), model.threads.end(),
                            [&](const auto& thread) { return thread.get() == entry.first; });
    });
}

}  // namespace hal
