// SPDX-License-Identifier: MIT
#include "panel/machine_list.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "machine/processes/address.hpp"

namespace hal::tools {

using Json = nlohmann::json;

MachineWatch* MachineList::find(const std::string& name) const {
    const auto at = std::find_if(machines_.begin(), machines_.end(),
                                 [&](const auto& one) { return one->name() == name; });
    return at == machines_.end() ? nullptr : at->get();
}

void MachineList::forget_ended() {
    while (machines_.size() > max_machines) {
        const auto ended =
            std::find_if(machines_.begin(), machines_.end(), [this](const auto& one) {
                return !one->present() && one->name() != own_;
            });
        if (ended == machines_.end()) return;
        machines_.erase(ended);
    }
}

void MachineList::tick(std::int64_t now) {
    bool changed = now - looked_ms_ >= interval_ms;
    if (changed) {
        looked_ms_ = now;
        look(now);
    }
    for (const auto& machine : machines_) {
        changed = machine->has_news() || changed;
    }
    if (changed) {
        report();
    }
}

void MachineList::look(std::int64_t now) {
    const std::vector<std::string> running = running_instances();
    std::vector<std::string> names = running;
    names.push_back(own_);
    for (const std::string& name : names) {
        if (!find(name)) {
            machines_.push_back(std::make_unique<MachineWatch>(host_, name));
        }
    }
    forget_ended();
    std::sort(machines_.begin(), machines_.end(),
              [](const auto& a, const auto& b) { return a->name() < b->name(); });
    for (const auto& machine : machines_) {
        const bool present =
            std::binary_search(running.begin(), running.end(), machine->name());
        machine->tick(now, present, machines_.size() > 1);
    }
}

void MachineList::report() {
    Json list = Json::array();
    for (const auto& machine : machines_) {
        list.push_back(machine->summary());
    }
    std::string event = Json{{"event", "machines"}, {"machines", std::move(list)}}.dump(
        -1, ' ', false, Json::error_handler_t::replace);
    if (event == event_) return;
    event_ = std::move(event);
    if (on_change) {
        on_change(event_);
    }
}

}  // namespace hal::tools
