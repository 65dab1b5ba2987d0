// SPDX-License-Identifier: MIT
#include "machine/run/plan_adoption.hpp"

#include <algorithm>

namespace hal {
namespace {

hal_value load(const hal_value& from) {
    return {.raw = __atomic_load_n(&from.raw, __ATOMIC_RELAXED)};
}

/// The pin stands alone, with the value it has, before the image it points into is freed.
void detach(const Pin& pin) {
    hal_pin& memory = *pin.memory;
    if (memory.slot == &memory.own) return;
    memory.own.raw = pin.type == HAL_TYPE_PORT ? 0 : load(*memory.slot).raw;
    memory.slot = &memory.own;
    if (pin.pointer) {
        *pin.pointer = memory.slot;
    }
}

void detach(const std::vector<std::unique_ptr<Instance>>& instances) {
    for (const auto& instance : instances) {
        for (const auto& pin : instance->pins) {
            detach(*pin);
        }
    }
}

}  // namespace

void PlanAdoption::adopt() {
    for (const Compiled::Place& place : compiled_.places) {
        if (!unknown(place)) {
            adopt_value(place);
        }
    }
    bind_session_pins();
    adopt_homes();
    for (Compiled::Place& place : compiled_.places) {
        adopt_copies(place);
        if (unknown(place)) continue;
        place.signal->home = place.home;
        place.signal->slot = place.slot;
        place.signal->cell = std::move(place.cell);
    }
    write_loose_pins();
    edit_.pin_values.clear();
    edit_.signal_values.clear();
    edit_.inherited.clear();
    if (all_answered_) {
        retire();
    }
}

void PlanAdoption::adopt_value(const Compiled::Place& place) {
    Signal& signal = *place.signal;
    if (place.cell) {
        const auto set = edit_.signal_values.find(&signal);
        if (set != edit_.signal_values.end()) {
            __atomic_store_n(&place.cell->raw, set->second.raw, __ATOMIC_RELAXED);
        }
    } else if (!place.home) {
        if (const hal_value* const value = value_without_thread(signal)) {
            signal.value = load(*value);
        }
    }
}

/// Returns the value of a signal that belongs to the session from now on; nullptr: it keeps its
/// own.
const hal_value* PlanAdoption::value_without_thread(const Signal& signal) const {
    if (const auto set = edit_.signal_values.find(&signal); set != edit_.signal_values.end()) {
        return &set->second;
    }
    if (const auto from = edit_.inherited.find(&signal); from != edit_.inherited.end()) {
        const auto pinned = edit_.pin_values.find(from->second);
        return pinned != edit_.pin_values.end() ? &pinned->second
                                                : edit_.present(*from->second).slot;
    }
    if (signal.cell) return signal.cell.get();
    return signal.home ? signal.slot : nullptr;
}

void PlanAdoption::bind_session_pins() {
    for (const auto& rebind : compiled_.session_rebinds) {
        if (rebind.slot == &rebind.pin->own) {
            rebind.pin->own = rebind.keeps_value ? *rebind.from : hal_value{.raw = 0};
        }
        rebind.pin->slot = rebind.slot;
    }
    for (const auto& pointer : compiled_.session_pointers) {
        *pointer.to = pointer.slot;
    }
}

void PlanAdoption::adopt_homes() {
    for (const auto& [pin, thread] : compiled_.homes) {
        if (!hangs_(pin->home) && !hangs_(thread)) {
            pin->home = thread;
        }
    }
}

void PlanAdoption::adopt_copies(Compiled::Place& place) {
    auto& copies = place.signal->copies;
    if (all_answered_) {
        copies = std::move(place.copies);
        return;
    }
    std::erase_if(place.copies, [&](const auto& copy) { return hangs_(copy.first); });
    std::erase_if(copies, [&](const auto& copy) { return !hangs_(copy.first); });
    copies.insert(copies.end(), place.copies.begin(), place.copies.end());
}

void PlanAdoption::write_loose_pins() {
    for (const auto& [pin, value] : edit_.pin_values) {
        if (!pin->home && !pin->signal) {
            *pin->memory->slot = value;
        }
    }
}

/// No thread uses the old instances of a reload, nor those that were unloaded.
void PlanAdoption::retire() {
    detach(edit_.removed().instances);
    for (const auto& one : edit_.replaced()) {
        detach(one.other->instances);
    }
    edit_.old_memory.clear();
}

}  // namespace hal
