// SPDX-License-Identifier: MIT
// Programs as components of the model: an instance without a plugin, whose pins belong to no
// thread. The session owns them, and their values reach threads like those of signals without a
// writer.
#include "machine/processes/program_model.hpp"

#include <algorithm>
#include <deque>
#include <unordered_set>

#include "machine/load/construct.hpp"
#include "machine/run/running_model.hpp"
#include "machine/run/state.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

using Memory = std::deque<hal_pin>;  // pins come one by one and never move

/// Makes the pin of an instance whose memory is a Memory.
std::unique_ptr<Pin> make_pin(Model& model, Instance& instance, const ProgramPin& wanted) {
    hal_pin& memory = static_cast<Memory*>(instance.storage.get())->emplace_back();
    memory.own = wanted.initial;
    memory.slot = &memory.own;
    auto pin = std::make_unique<Pin>();
    pin->name = wanted.name;
    pin->type = wanted.type;
    pin->dir = wanted.dir;
    if (wanted.read_only) {
        pin->flags |= HAL_PIN_READ_ONLY;
    }
    pin->doc = model.keep(wanted.doc);
    pin->unit = model.keep(wanted.unit);
    pin->initial = wanted.initial;
    if (wanted.safe) {
        pin->flags |= HAL_PIN_SAFE;
        pin->safe = *wanted.safe;
    }
    pin->memory = &memory;
    pin->instance = &instance;
    pin->id = model.next_id++;
    return pin;
}

Instance& make_instance(Edit& edit, LoadedComponent& component) {
    auto made = std::make_unique<Instance>();
    made->name = component.name;
    made->component = &component;
    made->storage = std::make_shared<Memory>();
    made->loaded = component.loaded;
    Instance& instance = *made;
    edit.add_instance(component, made, {});
    return instance;
}

LoadedComponent* find_program(Model& model, std::string_view name) {
    LoadedComponent* const component = model.find_component(name);
    return component && component->process != 0 ? component : nullptr;
}

}  // namespace

void ProgramModel::add_component(Transaction&, const std::string& name, std::int64_t pid,
                                 const Command& command) {
    Diagnostics none;
    LoadedComponent& component = state_.transaction.editing(none).add_component(name, command.span);
    component.process = pid;
    std::string text;
    for (const Token& token : command.args) {
        append_item(text, token.text, " ");
    }
    if (state_.options.sink) {
        state_.transaction.note({std::string(program_words::add), name, text});
    }
    component.arguments.push_back(std::move(text));
}

void ProgramModel::remove_component(Transaction&, std::string_view name) {
    Diagnostics none;
    if (LoadedComponent* const component = find_program(state_.model, name)) {
        state_.transaction.editing(none).remove_component(*component);
        if (state_.options.sink) {
            state_.transaction.note({std::string(program_words::remove), std::string(name)});
        }
    }
}

Pin* ProgramModel::add_pin(Transaction&, std::string_view component_name, const ProgramPin& wanted,
                           std::string& problem) {
    LoadedComponent* const component = find_program(state_.model, component_name);
    if (!component) {
        problem = "there is no program '" + std::string(component_name) + "'";
        return nullptr;
    }
    Diagnostics diagnostics;
    Edit& edit = state_.transaction.editing(diagnostics);
    Instance* instance = instance_of(component_name);
    if (!instance) {
        instance = &make_instance(edit, *component);
    }
    if (!diagnostics.failed()) {
        std::vector<std::unique_ptr<Pin>> row;
        row.push_back(make_pin(state_.model, *instance, wanted));
        Pin* const made = row.back().get();
        if (edit.add_pins(*instance, std::move(row), component->loaded)) {
            if (state_.options.sink) {
                state_.transaction.note({std::string(program_words::add_pin),
                                         std::string(component_name), wanted.name,
                                         std::to_string(wanted.type), std::to_string(wanted.dir),
                                         std::to_string(wanted.initial.raw)});
            }
            return made;
        }
    }
    problem = diagnostics.all().front().message;
    return nullptr;
}

void ProgramModel::remove_pins(Transaction&, std::string_view component_name,
                               const std::vector<Pin*>& pins) {
    Instance* const instance = instance_of(component_name);
    if (!instance || pins.empty()) return;
    Diagnostics none;
    Edit& edit = state_.transaction.editing(none);
    if (state_.options.sink) {
        std::vector<std::string> words{std::string(program_words::remove_pins),
                                       std::string(component_name)};
        for (const Pin* const pin : pins) {
            words.push_back(pin->name);
        }
        state_.transaction.note(std::move(words));
    }
    for (Pin* const pin : pins) {
        edit.unlink(*pin);
    }
    edit.remove_pins(*instance, pins);
}

void ProgramModel::add(const std::string& name, pid_t pid, const Command& command) {
    Transaction transaction = machine_.begin();
    add_component(transaction, name, pid, command);
    Diagnostics none;
    transaction.commit(none);
}

void ProgramModel::replace_process(std::string_view name, pid_t pid) {
    Transaction transaction = machine_.begin();
    Diagnostics none;
    if (LoadedComponent* const component = find_program(state_.model, name)) {
        state_.transaction.editing(none).set_process(*component, pid);
    }
    transaction.commit(none);
}

void ProgramModel::remove(std::string_view name) {
    Transaction transaction = machine_.begin();
    remove_component(transaction, name);
    Diagnostics refused;
    if (transaction.commit(refused)) return;
    // A thread that hangs may use its pins: the component stays in the model, but no process
    // answers for it.
    if (LoadedComponent* const component = state_.model.find_component(name)) {
        component->process = 0;
    }
}

void ProgramModel::keep_pins(std::string_view name, const std::vector<Pin*>& kept) {
    const Instance* const instance = instance_of(name);
    if (!instance) return;
    const std::unordered_set<const Pin*> keep(kept.begin(), kept.end());
    std::vector<Pin*> orphans;
    for (const auto& pin : instance->pins) {
        if (!keep.contains(pin.get())) {
            orphans.push_back(pin.get());
        }
    }
    if (orphans.empty()) return;
    Transaction transaction = machine_.begin();
    remove_pins(transaction, name, orphans);
    Diagnostics refused;
    transaction.commit(refused);
}

Instance* ProgramModel::instance_of(std::string_view name) const {
    const LoadedComponent* const component = find_program(state_.model, name);
    if (!component || component->instances.empty()) return nullptr;
    return component->instances.front().get();
}

}  // namespace hal
