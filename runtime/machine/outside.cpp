// SPDX-License-Identifier: MIT
// Components that are programs of their own: in the model an instance without a plugin, whose pins no thread runs. So the
// session owns them, and their values reach threads as those of signals that nothing writes.
#include <deque>

#include "machine/construct.hpp"
#include "machine/session.hpp"
#include "machine/state.hpp"

namespace hal {
namespace {

using Memory = std::deque<hal_pin>;  // pins come one by one and never move

Instance* instance_of(const LoadedComponent& component) {
    return component.instances.empty() ? nullptr : component.instances.front().get();
}

}  // namespace

void Session::add_process(Transaction&, const std::string& name, std::int64_t pid, const Command& command) {
    Diagnostics none;
    LoadedComponent& component = state_->editing(none).add_component(name, command.span);
    component.process = pid;
    std::string text;
    for (const Token& token : command.args) text += (text.empty() ? "" : " ") + token.text;
    component.arguments.push_back(std::move(text));
}

void Session::set_process(Transaction&, std::string_view name, std::int64_t pid) {
    Diagnostics none;
    LoadedComponent* const component = state_->model.find_component(name);
    if (component && component->process != 0) state_->editing(none).set_process(*component, pid);
}

void Session::remove_process(Transaction&, std::string_view name) {
    Diagnostics none;
    LoadedComponent* const component = state_->model.find_component(name);
    if (component && component->process != 0) state_->editing(none).remove_component(*component);
}

void Session::disown_process(std::string_view name) {
    if (LoadedComponent* const component = state_->model.find_component(name)) component->process = 0;
}

Pin* Session::add_outside_pin(Transaction&, std::string_view component_name, const OutsidePin& wanted, std::string& problem) {
    State& s = *state_;
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
        if (wanted.read_only) pin->flags |= HAL_PIN_READ_ONLY;
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

void Session::remove_outside_pins(Transaction&, std::string_view component_name, const std::vector<Pin*>& pins) {
    LoadedComponent* const component = state_->model.find_component(component_name);
    Instance* const instance = component ? instance_of(*component) : nullptr;
    if (!instance || pins.empty()) return;
    Diagnostics none;
    Edit& edit = state_->editing(none);
    for (Pin* const pin : pins) edit.unlink(*pin);
    edit.remove_pins(*instance, pins);
}

void Session::write_outside(const std::vector<std::pair<Pin*, hal_value>>& values) {
    Notes<Signal, hal_value> row;
    const auto flush = [&] {
        Diagnostics ignored;  // a thread that hangs is found by every edit; it takes no values
        if (!row.empty()) state_->write_values({}, row, ignored);
        row.clear();
    };
    for (const auto& [pin, value] : values) {
        Signal* const signal = pin->signal;
        if (!signal) {
            __atomic_store_n(&pin->memory->slot->raw, value.raw, __ATOMIC_RELAXED);
            continue;
        }
        if (pin->type == HAL_TYPE_PORT || (pin->dir == HAL_DIR_IN && (signal->writer || signal->home))) continue;
        row[signal] = value;
        if (row.size() >= Core::most_writes / 2) flush();
    }
    flush();
}

}  // namespace hal
