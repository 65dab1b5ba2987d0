// SPDX-License-Identifier: MIT
#include "machine/run/live_values.hpp"

#include <map>

#include "machine/run/execution_sink.hpp"
#include "machine/run/state.hpp"

namespace hal {
namespace {

struct Source {
    const hal_value* from;
    const Thread* owner;   // nullptr: the session may read it itself
    bool shared = false;   // the session writes it, too
};

// Of an open transaction: where the value is that the object would have now if the transaction took
// effect.
Source source(const SessionState& s, const Pin& pin);

Source source(const SessionState& s, const Signal& signal) {
    if (const Edit* const edit = s.transaction.edit()) {
        if (const auto set = edit->signal_values.find(&signal); set != edit->signal_values.end()) {
            return {&set->second, nullptr};
        }
        if (const auto from = edit->inherited.find(&signal); from != edit->inherited.end()) {
            const auto own = edit->pin_values.find(from->second);
            if (own != edit->pin_values.end()) {
                return {&own->second, nullptr};
            }
            return {edit->present(*from->second).slot, from->second->home, true};
        }
    }
    if (signal.cell || !signal.home) {
        return {signal.slot, nullptr};
    }
    return {signal.slot, signal.home, signal.ios != 0};
}

Source source(const SessionState& s, const Pin& pin) {
    if (pin.signal) return source(s, *pin.signal);
    const Edit* const edit = s.transaction.edit();
    if (!edit) {
        return {pin.memory->slot, pin.home, true};
    }
    if (const auto own = edit->pin_values.find(&pin); own != edit->pin_values.end()) {
        return {&own->second, nullptr};
    }
    return {edit->present(pin).slot, pin.home, true};
}

// `together`: all values of one thread are of one cycle.
std::vector<hal_value> read_all(SessionState& s, const std::vector<Source>& sources,
                                bool together = true) {
    struct Group {
        std::vector<const hal_value*> from;
        std::vector<std::size_t> at;
        std::vector<hal_value> to;
        Observation request;
    };
    std::vector<hal_value> values(sources.size());
    std::map<Core*, Group> groups;
    for (std::size_t i = 0; i < sources.size(); ++i) {
        const Source from = sources[i];
        Core* const core = from.owner ? s.threads.core(from.owner) : nullptr;
        // a single value is coherent with itself: no need to wait for the thread, unless it has
        // news of it in its queue
        const bool alone = !together || sources.size() == 1;
        if (!core || (alone && (core->settled() || (!together && !from.shared)))) {
            values[i].raw = __atomic_load_n(&from.from->raw, __ATOMIC_RELAXED);
            continue;
        }
        groups[core].from.push_back(from.from);
        groups[core].at.push_back(i);
    }
    std::vector<std::pair<Core*, Observation*>> requests;
    for (auto& [core, group] : groups) {
        group.to.resize(group.from.size());
        group.request.from = group.from.data();
        group.request.to = group.to.data();
        group.request.count = group.from.size();
        requests.emplace_back(core, &group.request);
    }
    if (!requests.empty()) {
        s.executor->observe(requests, answer_timeout_ns);
    }
    for (auto& [core, group] : groups) {
        const bool answered = group.request.done.load();
        for (std::size_t k = 0; k < group.at.size(); ++k) {
            if (answered) {
                values[group.at[k]] = group.to[k];
            }
            // it hangs: its memory does not change
            else {
                values[group.at[k]].raw = __atomic_load_n(&group.from[k]->raw, __ATOMIC_RELAXED);
            }
        }
    }
    return values;
}

template <class Object>
std::vector<Source> sources_of(const SessionState& s, const std::vector<const Object*>& objects) {
    std::vector<Source> all;
    for (const Object* object : objects) {
        all.push_back(source(s, *object));
    }
    return all;
}

}  // namespace

std::vector<hal_value> LiveValues::read_pins(const std::vector<const Pin*>& pins) {
    return read_all(state_, sources_of(state_, pins));
}
std::vector<hal_value> LiveValues::peek(const std::vector<Pin*>& pins) {
    std::vector<Source> all;
    for (const Pin* const pin : pins) {
        all.push_back(source(state_, *pin));
    }
    return read_all(state_, all, false);
}
std::vector<hal_value> LiveValues::read_signals(const std::vector<const Signal*>& signals) {
    return read_all(state_, sources_of(state_, signals));
}

std::vector<std::optional<Reading>> LiveValues::read(const std::vector<std::string>& names) {
    std::vector<std::optional<Reading>> readings(names.size());
    std::vector<Source> wanted;
    std::vector<std::size_t> at;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (const Pin* const pin = state_.model.find_pin(names[i])) {
            readings[i] = Reading{pin->type, {}};
            wanted.push_back(source(state_, *pin));
        } else if (const Signal* const signal = state_.model.find_signal(names[i])) {
            readings[i] = Reading{signal->type, {}};
            wanted.push_back(source(state_, *signal));
        } else {
            continue;
        }
        at.push_back(i);
    }
    const auto values = read_all(state_, wanted);
    for (std::size_t k = 0; k < at.size(); ++k) {
        readings[at[k]]->value = values[k];
    }
    return readings;
}

void LiveValues::write(const std::vector<std::pair<Pin*, hal_value>>& values) {
    if (state_.options.sink) {
        std::vector<std::pair<std::string, std::uint64_t>> noted;
        for (const auto& [pin, value] : values) {
            noted.emplace_back(pin->name, value.raw);
        }
        state_.options.sink->written(std::move(noted));
    }
    Notes<Signal, hal_value> row;
    const auto flush = [&] {
        Diagnostics ignored;  // a thread that hangs is found by every edit; it takes no values
        if (!row.empty()) {
            state_.threads.write({}, row, ignored);
        }
        row.clear();
    };
    for (const auto& [pin, value] : values) {
        Signal* const signal = pin->signal;
        if (!signal) {
            __atomic_store_n(&pin->memory->slot->raw, value.raw, __ATOMIC_RELAXED);
            continue;
        }
        if (pin->type == HAL_TYPE_PORT ||
            (pin->dir == HAL_DIR_IN && (signal->writer || signal->home))) {
            continue;
        }
        row[signal] = value;
        if (row.size() >= Core::max_writes / 2) {
            flush();
        }
    }
    flush();
}

}  // namespace hal
