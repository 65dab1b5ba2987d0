// SPDX-License-Identifier: MIT
#include "commands/listing.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fnmatch.h>

#include "machine/session.hpp"
#include "text/natural_order.hpp"
#include "text/sort_in_steps.hpp"

namespace hal {

bool Patterns::match(const std::string& name) const {
    if (patterns_.empty()) return true;
    return std::any_of(patterns_.begin(), patterns_.end(), [&](const std::string& pattern) {
        return name.starts_with(pattern) || fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
    });
}

const std::string& shown_name(const Pin& pin) { return pin.alias.empty() ? pin.name : pin.alias; }

bool is_parameter(const Pin& pin) {
    return pin.dir == HAL_DIR_PARAM ||
           (!pin.instance && !pin.signal && pin.name.ends_with(".tmax-increased"));
}

const char* direction_text(const Pin& pin) {
    return pin.read_only() || (is_parameter(pin) && pin.dir != HAL_DIR_PARAM) ? "RO"
                                                                              : name(pin.dir);
}

std::vector<const Pin*> pins_by_name(const Session& session, bool parameters,
                                     const Patterns& patterns) {
    std::vector<const Pin*> chosen;
    for (const auto& [name, pin] : session.model().pin) {
        if (session.ending()) return {};
        if (name == pin->name && is_parameter(*pin) == parameters &&
            patterns.match(shown_name(*pin))) {
            chosen.push_back(pin);
        }
    }
    sort_in_steps(chosen, [](const Pin* a, const Pin* b) {
        return natural_less(shown_name(*a), shown_name(*b));
    }, [&] { return session.ending(); });
    return chosen;
}

std::vector<const Signal*> signals_by_name(const Session& session, const Patterns& patterns) {
    std::vector<const Signal*> chosen;
    for (const auto& signal : session.model().signals) {
        if (session.ending()) return {};
        if (patterns.match(signal->name)) {
            chosen.push_back(signal.get());
        }
    }
    sort_in_steps(chosen, [](const Signal* a, const Signal* b) {
        return natural_less(a->name, b->name);
    }, [&] { return session.ending(); });
    return chosen;
}

std::vector<const LoadedFunction*> functions_by_name(const Model& model, const Patterns& patterns) {
    auto all = model.sorted_functions();
    std::erase_if(all,
                  [&](const LoadedFunction* function) { return !patterns.match(function->name); });
    return all;
}

std::vector<const LoadedComponent*> components_newest_first(const Model& model,
                                                            const Patterns& patterns) {
    std::vector<const LoadedComponent*> chosen;
    for (const auto& component : model.components) {
        if (patterns.match(component->name)) {
            chosen.push_back(component.get());
        }
    }
    std::sort(chosen.begin(), chosen.end(),
              [](const LoadedComponent* a, const LoadedComponent* b) { return a->id > b->id; });
    return chosen;
}

std::vector<const Thread*> threads_slowest_first(const Model& model, const Patterns& patterns) {
    std::vector<const Thread*> chosen;
    for (auto thread = model.threads.rbegin(); thread != model.threads.rend(); ++thread) {
        if (patterns.match((*thread)->name)) {
            chosen.push_back(thread->get());
        }
    }
    return chosen;
}

std::string clock_text(const Session& session) {
    const auto clock = session.reports().clock();
    if (!clock) {
        return {};
    }
    constexpr std::int64_t in_use_ns = 1'000'000'000;
    if (!clock->idle_ns) return fmt::format("Clock not yet adjusted by {}\n", clock->leader);
    const auto shift = static_cast<double>(clock->shift_ns);
    const std::string offset =
        fmt::format("{} {} than the local clock", format_duration(std::abs(shift)),
                    shift < 0 ? "earlier" : "later");
    if (*clock->idle_ns >= in_use_ns) {
        return fmt::format("Clock last adjusted by {} {} ago: {}\n", clock->leader,
                           format_duration(static_cast<double>(*clock->idle_ns)), offset);
    }
    return fmt::format("Clock disciplined by {}: {}, drift {:+.1f} ppm\n", clock->leader, offset,
                       clock->rate * 1e6);
}

const LoadedComponent* owner(const Pin& pin) {
    if (pin.instance) return pin.instance->component;
    if (pin.function) return pin.function->component;
    return pin.of_thread ? pin.of_thread->component : nullptr;
}

const char* arrow_of_pin(const Pin& pin) {
    if (pin.dir == HAL_DIR_OUT) return "==>";
    if (pin.dir == HAL_DIR_IO) return "<=>";
    return "<==";
}

const char* arrow_of_signal(const Pin& pin) {
    if (pin.dir == HAL_DIR_OUT) return "<==";
    if (pin.dir == HAL_DIR_IO) return "<=>";
    return "==>";
}

std::string table_value(hal_type type, const hal_value& value) {
    if (type == HAL_TYPE_U32) {
        return fmt::format("0x{:08X}", value.u32);
    }
    if (type == HAL_TYPE_U64) {
        return fmt::format("0x{:016X}", value.u64);
    }
    return format_value(type, value);
}

std::string saved_value(hal_type type, const hal_value& value) {
    return type == HAL_TYPE_FLOAT ? format_exact(type, value) : table_value(type, value);
}

}  // namespace hal
