// SPDX-License-Identifier: MIT
#include "model/compile.hpp"

#include <algorithm>
#include <map>

namespace hal {
namespace {

template <class Action>
void for_all_pins(const Model& model, Action action) {
    for (const auto& component : model.components) {
        for (const auto& instance : component->instances) {
            for (const auto& pin : instance->pins) {
                action(*pin);
            }
        }
        for (const auto& function : component->functions) {
            for (const auto& pin : function->pins) {
                action(*pin);
            }
        }
    }
    for (const auto& thread : model.threads) {
        for (const auto& pin : thread->pins) {
            action(*pin);
        }
    }
}

class Compiler {
public:
    Compiler(const Model& model, const CompileInput& input) : model_(model), input_(input) {
        for (const auto& component : model.components) {
            if (!component->shares_pins) continue;
            for (const auto& function : component->functions) {
                sharing_functions_.push_back(function.get());
            }
            for (const auto& instance : component->instances) {
                if (instance->functions.empty()) {
                    instances_without_function_.push_back(instance.get());
                }
            }
        }
    }

    Compiled run() {
        for (const auto& thread : model_.threads) {
            auto plan = std::make_unique<plan::Plan>();
            plan->epoch = input_.epoch;
            plans_[thread.get()] = plan.get();
            out_.plans.emplace_back(thread.get(), std::move(plan));
        }
        out_.places.resize(model_.signals.size());
        for (const auto& signal : model_.signals) {
            find_home(*signal);
        }
        for (auto& [thread, plan] : out_.plans) {
            lay_out(*thread, *plan);
        }
        for (auto& [thread, plan] : out_.plans) {
            steps(*thread, *plan);
        }
        for (auto& place : out_.places) {
            connect(place);
        }
        for (const auto& [pair, at] : channels_) {
            plan::Export& out = plans_[pair.first]->exports[at.first];
            out.channel = plans_[pair.second]->imports[at.second].channel =
                std::make_shared<plan::Channel>(out.from.size());
        }
        for_all_pins(model_, [this](Pin& pin) { bind(pin); });
        for (auto& [thread, plan] : out_.plans) {
            plan->scratch.resize(plan->carries.size());
        }
        for (const auto& request : unknown_) {
            out_.unknowns.push_back(
                {&plans_[request.plan]->carries[request.index], request.from, request.owner});
        }
        return std::move(out_);
    }

private:
    using Copy = std::pair<Thread*, hal_value*>;

    bool excluded(const LoadedFunction* function) const {
        return function->halted || (input_.without && input_.without->contains(function));
    }

    // Where a pin's value is before the plan is taken: in the instance the threads know.
    const hal_pin& present(const Pin& pin) const {
        const auto old = input_.old_memory->find(&pin);
        return old == input_.old_memory->end() ? *pin.memory : *old->second;
    }

    Thread* thread_for(const Pin& pin) const {
        if (pin.of_thread) return pin.of_thread;
        if (pin.function) return excluded(pin.function) ? nullptr : pin.function->thread;
        for (const LoadedFunction* function : users_of(pin)) {
            if (function->thread && !excluded(function)) return function->thread;
        }
        return nullptr;
    }

    // The functions that may use a pin without one of its own. Components that call each other
    // share their pins.
    const std::vector<LoadedFunction*>& users_of(const Pin& pin) const {
        const LoadedComponent* const component = pin.instance->component;
        const bool is_shared =
            pin.instance->functions.empty() && component && component->shares_pins;
        return is_shared ? sharing_functions_ : pin.instance->functions;
    }

    // A loose pin whose functions are in two threads, or that threads of its component's own use;
    // what it is linked to cannot live with one of them.
    bool spread(const Pin& pin) const {
        if (!is_loose(pin)) return false;
        if (pin.instance->own_threads) return true;
        const Thread* first = nullptr;
        for (const LoadedFunction* function : users_of(pin)) {
            if (!function->thread || excluded(function)) continue;
            if (first && function->thread != first) return true;
            first = function->thread;
        }
        return false;
    }

    // The pin's slot is the cell itself, not a copy of it.
    bool in_cell(const Compiled::Place& place, const Pin& pin) const {
        return place.cell && (pin.dir != HAL_DIR_IN || spread(pin));
    }

    // Values live with their writer: an OUT pin's thread, the thread of all I/O pins, or a cell
    // they share.
    void find_home(Signal& signal) {
        Compiled::Place& place = out_.places[signal.index];
        place = {&signal, nullptr, nullptr, {}, nullptr};
        if (signal.type != HAL_TYPE_PORT &&
            std::any_of(signal.pins.begin(), signal.pins.end(),
                        [this](const Pin* pin) { return spread(*pin); })) {
            place.cell =
                signal.cell ? signal.cell : std::make_shared<hal_value>(known_value(signal));
            place.slot = place.cell.get();
        } else if (signal.writer) {
            place.home = thread_for(*signal.writer);
        } else if (signal.ios != 0) {
            bool several = false;
            for (const Pin* pin : signal.pins) {
                if (pin->dir != HAL_DIR_IO) continue;
                Thread* const thread = thread_for(*pin);
                if (!thread) continue;
                several = several || (place.home && place.home != thread);
                place.home = thread;
            }
            if (several) {
                place.home = nullptr;
                place.cell =
                    signal.cell ? signal.cell : std::make_shared<hal_value>(known_value(signal));
                place.slot = place.cell.get();
            }
        }
    }

    // For a cell made now, before any thread takes part: what the session knows.
    hal_value known_value(const Signal& signal) const {
        if (const auto at = input_.signal_values->find(&signal);
            at != input_.signal_values->end()) {
            return at->second;
        }
        if (const auto at = input_.inherited->find(&signal); at != input_.inherited->end()) {
            return *present(*at->second).slot;
        }
        return *signal.slot;
    }

    // The thread reads or writes the signal in its own image: at home, or as a copy.
    static bool has_slot(const Compiled::Place& place, const Thread& thread) {
        if (place.home == &thread) return place.slot != nullptr;
        return std::ranges::any_of(place.copies,
                                   [&](const auto& copy) { return copy.first == &thread; });
    }

    // Asks for a slot of the pin's signal in the image of the thread, unless there is one.
    void want(const Pin& pin, Thread& thread, std::vector<Compiled::Place*>& wanted) {
        if (!pin.signal || thread_for(pin) != &thread) return;
        Compiled::Place& place = out_.places[pin.signal->index];
        if (in_cell(place, pin) || has_slot(place, thread)) return;
        static hal_value pending;  // a mark until the image exists
        if (place.home == &thread) {
            place.slot = &pending;
        } else {
            place.copies.emplace_back(&thread, &pending);
        }
        wanted.push_back(&place);
    }

    void want_all(const std::vector<std::unique_ptr<Pin>>& pins, Thread& thread,
                  std::vector<Compiled::Place*>& wanted) {
        for (const auto& pin : pins) {
            want(*pin, thread, wanted);
        }
    }

    // The signals of the thread in the order in which the cycle first meets them.
    std::vector<Compiled::Place*> wanted_by(Thread& thread) {
        std::vector<Compiled::Place*> wanted;
        for (const auto* row : {&thread.init, &thread.functions}) {
            for (const LoadedFunction* function : *row) {
                if (excluded(function)) continue;
                for (const Instance* instance : function->instances) {
                    want_all(instance->pins, thread, wanted);
                }
                want_all(function->pins, thread, wanted);
            }
        }
        for (const Instance* const instance : instances_without_function_) {
            want_all(instance->pins, thread, wanted);
        }
        want_all(thread.pins, thread, wanted);
        return wanted;
    }

    void lay_out(Thread& thread, plan::Plan& plan) {
        const std::vector<Compiled::Place*> wanted = wanted_by(thread);
        plan.image_size = wanted.size();
        plan.image = std::make_unique<hal_value[]>(wanted.size());
        for (std::size_t i = 0; i < wanted.size(); ++i) {
            Compiled::Place& place = *wanted[i];
            hal_value* const slot = &plan.image[i];
            if (place.home == &thread) {
                place.slot = slot;
            } else {
                std::ranges::find(place.copies, &thread, &Copy::first)->second = slot;
            }
        }
    }

    /// Adds the functions of a thread to its plan, in their order. Behind a function are the checks
    /// of its outputs that must be finite; around one that shares its state with functions of other
    /// threads is a gate, when the cycles are journaled. Each instance adds its emergency function
    /// once.
    void steps(Thread& thread, plan::Plan& plan) {
        std::size_t checks = 0;
        for (const auto* row : {&thread.init, &thread.functions}) {
            for (const LoadedFunction* function : *row) {
                for (const Instance* instance : function->instances) {
                    checks += instance->finite.size();
                }
            }
        }
        plan.finite_checks = std::make_unique<plan::FiniteCheck[]>(checks);
        std::size_t check = 0;
        std::unordered_set<const Instance*> met;
        const auto fill = [&](const std::vector<LoadedFunction*>& row, std::vector<plan::Step>& to,
                              std::vector<plan::Function>& functions) {
            for (LoadedFunction* function : row) {
                if (excluded(function)) continue;
                const auto begin = static_cast<std::uint32_t>(to.size());
                plan::Gate* const gate = input_.journaled() && shares_state(*function)
                                             ? add_gate(thread, *function, plan)
                                             : nullptr;
                if (gate) {
                    to.push_back({input_.enter_gate, gate});
                }
                to.insert(to.end(), function->steps.begin(), function->steps.end());
                for (const Instance* instance : function->instances) {
                    for (const Pin* pin : instance->finite) {
                        if (pin->function && pin->function != function) continue;
                        plan.finite_checks[check] = {pin->memory, pin->safe, pin->id,
                                                     input_.core_of(thread), false};
                        to.push_back({input_.check_finite, &plan.finite_checks[check++]});
                    }
                }
                if (gate) {
                    to.push_back({input_.leave_gate, gate});
                }
                functions.push_back({begin, static_cast<std::uint32_t>(to.size()), function->id,
                                     function->times.get()});
                for (const Instance* instance : function->instances) {
                    if (met.insert(instance).second) {
                        plan.emergency.insert(plan.emergency.end(), instance->emergency.begin(),
                                              instance->emergency.end());
                    }
                }
            }
        };
        fill(thread.init, plan.init_steps, plan.init);
        fill(thread.functions, plan.steps, plan.functions);
        rows(thread, plan);
        note_working_set(thread, plan);
    }

    // One of its instances has functions in another thread, too, or pins in cells that other
    // threads write, or reads what the supervisor writes.
    bool shares_state(const LoadedFunction& of) const {
        const auto elsewhere = [&](const LoadedFunction* other) {
            return other->thread && other->thread != of.thread && !excluded(other);
        };
        const auto cell = [&](const auto& pin) {
            return pin->signal && in_cell(out_.places[pin->signal->index], *pin);
        };
        return std::ranges::any_of(of.instances, [&](const Instance* instance) {
            return instance->reads_supervision ||
                   std::ranges::any_of(instance->functions, elsewhere) ||
                   std::ranges::any_of(instance->pins, cell);
        });
    }

    plan::Gate* add_gate(const Thread& thread, const LoadedFunction& function,
                         plan::Plan& plan) const {
        plan.gates.push_back(std::make_unique<plan::Gate>());
        plan::Gate& gate = *plan.gates.back();
        gate.counters = input_.gate->counters;
        gate.progress = input_.gate->progress;
        gate.seen_progress = input_.gate->seen_progress;
        gate.core = input_.core_of(thread);
        for (const Instance* instance : function.instances) {
            add_state(*instance, gate.state);
        }
        gate.state.complete();
        return &gate;
    }

    /// All words of its memory but the pointers that a plan sets.
    static void add_state(const Instance& instance, plan::SharedState& state) {
        std::unordered_set<const void*> pointers;
        for (const auto& pin : instance.pins) {
            pointers.insert(&pin->memory->slot);
            pointers.insert(pin->pointer);
            if (pin->dir == HAL_DIR_OUT || pin->dir == HAL_DIR_IO) {
                state.add(pin->memory);
            }
        }
        const auto add = [&](void* memory, std::size_t bytes) {
            auto* const words = static_cast<std::uint64_t*>(memory);
            for (std::size_t i = 0; i < bytes / sizeof *words; ++i) {
                if (!pointers.contains(words + i)) {
                    state.add(words + i);
                }
            }
        };
        add(instance.memory, instance.component->plugin->instance_size);
        for (const Instance::Block& block : instance.blocks) {
            add(block.memory.get(), block.used);
        }
    }

    void rows(const Thread& thread, plan::Plan& plan) const {
        std::unordered_map<hal_step, hal_row> known;
        for (const LoadedFunction* function : thread.functions) {
            if (function->row.run) {
                known[function->row.step] = function->row.run;
            }
        }
        const auto add = [&](hal_row row, std::size_t end) {
            if (!plan.rows.empty() && !row && !plan.rows.back().run) {
                plan.rows.back().end = static_cast<std::uint32_t>(end);
            } else {
                plan.rows.push_back({row, static_cast<std::uint32_t>(end)});
            }
        };
        for (std::size_t begin = 0, end; begin < plan.steps.size(); begin = end) {
            const hal_step step = plan.steps[begin].step;
            for (end = begin + 1; end < plan.steps.size() && plan.steps[end].step == step;) {
                ++end;
            }
            const auto row = end - begin < plan::Row::worth ? known.end() : known.find(step);
            add(row == known.end() ? nullptr : row->second, end);
        }
    }

    // Instances of one loadrt lie in a row: mostly one entry for all of them.
    void note_working_set(const Thread& thread, plan::Plan& plan) const {
        constexpr std::size_t gap = 64;  // closer than that is in a row
        // assumed size of a function's code: its length is unknown
        constexpr std::size_t code = 2048;
        auto& set = plan.working_set;
        set.push_back({plan.steps.data(), plan.steps.size() * sizeof(plan::Step)});
        set.push_back({plan.image.get(), plan.image_size * sizeof(hal_value)});
        std::unordered_set<hal_step> met;
        for (const plan::Step& step : plan.steps) {
            if (met.insert(step.step).second) {
                set.push_back({reinterpret_cast<const void*>(step.step), code});
            }
        }
        for (const plan::Row& row : plan.rows) {
            if (row.run) {
                set.push_back({reinterpret_cast<const void*>(row.run), code});
            }
        }
        const std::size_t before = set.size();
        for (const LoadedFunction* function : thread.functions) {
            if (excluded(function)) continue;
            for (const Instance* instance : function->instances) {
                const auto begin = reinterpret_cast<std::uintptr_t>(instance->memory);
                const std::size_t bytes = instance->component->plugin->instance_size;
                plan::Memory& last = set.back();
                const auto end = reinterpret_cast<std::uintptr_t>(last.begin) + last.bytes;
                if (set.size() > before && begin >= end && begin - end < gap) {
                    last.bytes += begin - end + bytes;
                } else {
                    set.push_back({instance->memory, bytes});
                }
            }
        }
        // what instances have beside their own memory: once each, in a row where it lies so
        std::unordered_set<const Instance*> noted;
        for (const LoadedFunction* function : thread.functions) {
            for (const Instance* instance : function->instances) {
                if (!excluded(function) && noted.insert(instance).second) {
                    for (const Instance::Block& block : instance->blocks) {
                        set.push_back({block.memory.get(), block.used});
                    }
                    set.insert(set.end(), instance->further.begin(), instance->further.end());
                }
            }
        }
    }

    plan::Export& channel(Thread* from, Thread* to) {
        auto [at, made] = channels_.try_emplace({from, to}, 0, 0);
        plan::Plan& writer = *plans_[from];
        plan::Plan& reader = *plans_[to];
        if (made) {
            at->second = {writer.exports.size(), reader.imports.size()};
            writer.exports.emplace_back();
            reader.imports.emplace_back();
        }
        import_ = &reader.imports[at->second.second];
        return writer.exports[at->second.first];
    }

    void connect(Compiled::Place& place) {
        Signal& signal = *place.signal;
        if (place.home) {
            carry(signal, place.home, place.slot);
        } else if (!place.cell) {
            place.slot = &signal.value;
        }
        if (place.cell) {
            for (const auto& [thread, plan] : plans_) {
                plan->keep.push_back(place.cell);
            }
        }
        for (auto& [reader, slot] : place.copies) {
            carry(signal, reader, slot);
            if (place.cell) {
                plans_[reader]->cell_imports.push_back({slot, place.cell.get()});
            } else if (place.home) {
                plan::Export& to = channel(place.home, reader);
                to.from.push_back(place.slot);
                import_->to.push_back(slot);
            }
        }
    }

    void carry(Signal& signal, Thread* thread, hal_value* to) {
        const hal_value* from = nullptr;
        hal_value value{};
        if (const auto set = input_.signal_values->find(&signal);
            set != input_.signal_values->end()) {
            value = set->second;
        } else if (const auto given = input_.inherited->find(&signal);
                   given != input_.inherited->end()) {
            const Pin& pin = *given->second;
            if (const auto pinned = input_.pin_values->find(given->second);
                pinned != input_.pin_values->end()) {
                value = pinned->second;
            } else if (pin.home == thread) {
                from = present(pin).slot;
            } else if (!pin.home) {
                value = *present(pin).slot;
            } else {
                return unknown(thread, to, present(pin).slot, pin.home);
            }
        } else if (signal.cell) {
            from = signal.cell.get();
        } else if (signal.home == thread) {
            from = signal.slot;
        } else if (const auto copy = std::find_if(signal.copies.begin(), signal.copies.end(),
                                                  [&](const auto& c) { return c.first == thread; });
                   copy != signal.copies.end() && signal.home) {
            from = copy->second;
        } else if (!signal.home) {
            value = signal.value;
        } else {
            return unknown(thread, to, signal.slot, signal.home);
        }
        plans_[thread]->carries.push_back({to, from, value});
    }

    void unknown(Thread* thread, hal_value* to, const hal_value* from, Thread* owner) {
        unknown_.push_back({thread, plans_[thread]->carries.size(), from, owner});
        plans_[thread]->carries.push_back({to, nullptr, {}});
    }

    // Where the pin's value is once the plan has been taken.
    hal_value* slot_of(const Pin& pin, Thread* thread) {
        if (!pin.signal) return &pin.memory->own;
        const Compiled::Place& place = out_.places[pin.signal->index];
        if (in_cell(place, pin)) return place.slot;
        if (!thread) return &pin.signal->value;
        if (place.home == thread) return place.slot;
        const auto copy = std::ranges::find(place.copies, thread, &Copy::first);
        return copy == place.copies.end() ? &pin.memory->own : copy->second;
    }

    // An unlinked pin keeps the last value, unless the edit sets it; a stream's buffer stays with
    // its signal.
    void carry_unlinked(const Pin& pin, const Thread* thread, hal_value* slot, plan::Plan& plan) {
        const hal_pin& now = present(pin);
        if (const auto set = input_.pin_values->find(&pin); set != input_.pin_values->end()) {
            plan.carries.push_back({slot, nullptr, set->second});
        } else if (now.slot == slot) {
            return;
        } else if (pin.type == HAL_TYPE_PORT) {
            plan.carries.push_back({slot, nullptr, {.raw = 0}});
        } else if (pin.home == thread) {
            plan.carries.push_back({slot, now.slot, {}});
        } else {
            plan.carries.push_back({slot, nullptr, *now.slot});
        }
    }

    void bind(Pin& pin) {
        Thread* const thread = thread_for(pin);
        if (thread != pin.home) {
            out_.homes.emplace_back(&pin, thread);
        }
        plan::Plan* const plan = thread ? plans_[thread] : nullptr;
        hal_value* const slot = slot_of(pin, thread);
        const hal_pin& now = present(pin);
        if (!pin.signal && plan) {
            carry_unlinked(pin, thread, slot, *plan);
        }
        const bool moves = pin.memory->slot != slot;
        if (plan && moves) {
            plan->rebinds.push_back({pin.memory, slot});
        } else if (!plan && (moves || &now != pin.memory)) {
            out_.session_rebinds.push_back({pin.memory, slot, now.slot, pin.type != HAL_TYPE_PORT});
        }
        if (plan && input_.journaled()) {
            check(pin, slot, *plan);
        }
        if (pin.pointer) {
            (plan ? plan->pointers : out_.session_pointers).push_back({pin.pointer, slot});
        }
        if (plan && (pin.flags & HAL_PIN_SAFE)) {
            plan->safe.push_back({pin.memory, pin.safe});
        }
    }

    // What the checksum of a journaled cycle covers: each value once, but no cell, which other
    // threads write at any time, and no port, whose value is an address.
    void check(const Pin& pin, const hal_value* slot, plan::Plan& plan) {
        if (pin.type == HAL_TYPE_PORT) return;
        if (pin.signal && in_cell(out_.places[pin.signal->index], pin)) return;
        if (!checked_.insert(slot).second) return;
        plan.checked.push_back({slot, mask_of(pin.type)});
    }

    static std::uint64_t mask_of(hal_type type) {
        switch (type) {
        case HAL_TYPE_BIT: return 0xff;
        case HAL_TYPE_S32:
        case HAL_TYPE_U32: return 0xffffffff;
        default: return ~std::uint64_t{0};
        }
    }

    struct Unknown {
        Thread* plan;
        std::size_t index;
        const hal_value* from;
        Thread* owner;
    };

    const Model& model_;
    const CompileInput& input_;
    /// of components that share their pins, as are the instances
    std::vector<LoadedFunction*> sharing_functions_;
    std::vector<const Instance*> instances_without_function_;
    Compiled out_;
    std::unordered_map<Thread*, plan::Plan*> plans_;
    std::map<std::pair<Thread*, Thread*>, std::pair<std::size_t, std::size_t>> channels_;
    plan::Import* import_ = nullptr;
    std::vector<Unknown> unknown_;
    std::unordered_set<const hal_value*> checked_;
};

}  // namespace

Compiled compile(const Model& model, const CompileInput& input) {
    return Compiler(model, input).run();
}

std::unordered_set<const LoadedFunction*> moving(const Model& model) {
    std::unordered_set<const LoadedFunction*> functions;
    for_all_pins(model, [&](const Pin& pin) {
        Thread* const to = thread_of(pin);
        if (!pin.home || !to || pin.home == to) return;
        if (pin.function) {
            functions.insert(pin.function);
        } else if (pin.instance) {
            functions.insert(pin.instance->functions.begin(), pin.instance->functions.end());
        }
    });
    return functions;
}

}  // namespace hal
