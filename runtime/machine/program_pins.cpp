// SPDX-License-Identifier: MIT
// Programs as components of the model: an instance without a plugin, whose pins belong to no
// thread. The session owns them, and their values reach threads like those of signals without a
// writer.
#include <deque>

#include "machine/construct.hpp"
#include "machine/programs.hpp"
#include "machine/session.hpp"
#include "machine/state.hpp"

namespace hal {
namespace {

using Memory = std::deque<hal_pin>;  // pins come one by one and never move

Instance* instance_of(const LoadedComponent& component) {
    return component.instances.empty() ? nullptr : component.instances.front().get();
}

}  // namespace

void Programs::add_component(Transaction&, const std::string& name, std::int64_t pid,
                             const Command& command) {
    Diagnostics none;
    LoadedComponent& component = state_.editing(none).add_component(name, command.span);
    component.process = pid;
    std::string text;
    for (const Token& token : command.args) {
        text += (text.empty() ? "" : " ") + token.text;
    }
    component.arguments.push_back(std::move(text));
}

void Programs::add_to_model(const std::string& name, pid_t pid, const Command& command) {
    Transaction transaction = session_.begin();
    add_component(transaction, name, pid, command);
    Diagnostics none;
    transaction.commit(none);
}

void Programs::replace_in_model(std::string_view name, pid_t pid) {
    Transaction transaction = session_.begin();
    Diagnostics none;
    LoadedComponent* const component = state_.model.find_component(name);
    if (component && component->process != 0) {
        state_.editing(none).set_process(*component, pid);
    }
    transaction.commit(none);
}

void Programs::remove_component(Transaction&, std::string_view name) {
    Diagnostics none;
    LoadedComponent* const component = state_.model.find_component(name);
    if (component && component->process != 0) {
        state_.editing(none).remove_component(*component);
    }
}

void Programs::remove_from_model(std::string_view name) {
    Transaction transaction = session_.begin();
    remove_component(transaction, name);
    Diagnostics refused;
    if (transaction.commit(refused)) return;
    // A thread that hangs may use its pins: the component stays in the model, but no process
    // answers for it.
    if (LoadedComponent* const component = state_.model.find_component(name)) {
        component->process = 0;
    }
}

bool Programs::has_pins(const Entry& entry) const {
    const LoadedComponent* const component =
        entry.name.empty() ? nullptr : state_.model.find_component(entry.name);
    return component && component->process != 0 && !component->instances.empty();
}

Pin* Programs::add_pin(Transaction&, std::string_view component_name, const ProgramPin& wanted,
                       std::string& problem) {
    SessionState& s = state_;
    LoadedComponent* const component = s.model.find_component(component_name);
    if (!component || component->process == 0) {
        problem = "there is no program '" + std::string(component_name) + "'";
        return nullptr;
    }
    Diagnostics diagnostics;
    Edit& edit = s.editing(diagnostics);
    Instance* instance = instance_of(*component);
    if (!instance) {
        auto made = std::make_unique<Instance>();
        made->name = component->name;
        made->component = component;
        made->storage = std::make_shared<Memory>();
        made->loaded = component->loaded;
        instance = made.get();
        edit.add_instance(*component, made, {});
    }
    if (!diagnostics.failed()) {
        hal_pin& memory = static_cast<Memory*>(instance->storage.get())->emplace_back();
        auto pin = std::make_unique<Pin>();
        pin->name = wanted.name;
        pin->type = wanted.type;
        pin->dir = wanted.dir;
        if (wanted.read_only) {
            pin->flags |= HAL_PIN_READ_ONLY;
        }
        pin->doc = s.model.keep(wanted.doc);
        pin->unit = s.model.keep(wanted.unit);
        pin->initial = wanted.initial;
        if (wanted.safe) {
            pin->flags |= HAL_PIN_SAFE;
            pin->safe = *wanted.safe;
        }
        pin->memory = &memory;
        memory.own = wanted.initial;
        memory.slot = &memory.own;
        pin->instance = instance;
        pin->id = s.model.next_id++;
        Pin* const made = pin.get();
        std::vector<std::unique_ptr<Pin>> row;
        row.push_back(std::move(pin));
        if (edit.add_pins(*instance, std::move(row), component->loaded)) return made;
    }
    problem = diagnostics.all().front().message;
    return nullptr;
}

void Programs::remove_pins(Transaction&, std::string_view component_name,
                           const std::vector<Pin*>& pins) {
    LoadedComponent* const component = state_.model.find_component(component_name);
    Instance* const instance = component ? instance_of(*component) : nullptr;
    if (!instance || pins.empty()) return;
    Diagnostics none;
    Edit& edit = state_.editing(none);
    for (Pin* const pin : pins) {
        edit.unlink(*pin);
    }
    edit.remove_pins(*instance, pins);
}

}  // namespace hal
