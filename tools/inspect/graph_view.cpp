// SPDX-License-Identifier: MIT
#include "inspect/graph_view.hpp"

#include <algorithm>
#include <fmt/core.h>

#include "text/suggest.hpp"

namespace hal::tools {

namespace {

// instances of a drawing that shows unlinked pins unasked
constexpr std::size_t max_with_all_pins = 40;

std::string unknown_name(const Model& model, const std::string& name) {
    std::vector<std::string> names;
    for (const auto& [key, item] : model.instance) {
        names.emplace_back(key);
    }
    for (const auto& [key, item] : model.pin) {
        names.emplace_back(key);
    }
    for (const auto& [key, item] : model.signal) {
        names.emplace_back(key);
    }
    std::sort(names.begin(), names.end());
    names.erase(std::unique(names.begin(), names.end()), names.end());
    const std::string hint = did_you_mean(name, names);
    return fmt::format("no pin, signal or instance '{}'; {}", name,
                       hint.empty() ? "--around takes a name of the netlist" : hint);
}

}  // namespace

const Pin* source_of(const Signal& signal) {
    if (signal.writer) return signal.writer;
    for (const Pin* pin : signal.pins) {
        if (pin->dir == HAL_DIR_IO) return pin;
    }
    return nullptr;
}

bool is_hub(const Signal& signal) { return signal.pins.size() > max_edges + 1; }

GraphView::GraphView(const Model& model, const Sources& sources, const GraphRequest& request) {
    const bool whole = request.around.empty();
    if (whole) {
        for (const auto& component : model.components) {
            for (const auto& item : component->instances) {
                shown_.insert(item.get());
            }
        }
    } else {
        select_around(model, request);
    }
    if (!problem_.empty()) return;
    all_pins_ = request.all_pins.value_or(whole && shown_.size() <= max_with_all_pins);
    select_signals(model, whole);
    make_clusters(model, sources, request.cluster);
}

bool GraphView::shows(const Pin& pin) const {
    return pin.instance ? shows(*pin.instance) : pin.signal != nullptr;
}

// A breadth-first search over instances. A step follows all signals of an instance, the first one
// only the named signal.
void GraphView::select_around(const Model& model, const GraphRequest& request) {
    std::vector<const Instance*> border;
    const auto reach = [&](const Signal& signal) {
        for (const Pin* pin : signal.pins) {
            if (pin->instance && shown_.insert(pin->instance).second) {
                border.push_back(pin->instance);
            }
        }
    };
    const auto follow = [&](const std::vector<const Instance*>& from) {
        for (const Instance* instance : from) {
            for (const auto& pin : instance->pins) {
                if (pin->signal && !is_hub(*pin->signal)) {
                    reach(*pin->signal);
                }
            }
        }
    };
    std::size_t steps = request.depth;
    if (const Instance* const instance = model.find_instance(request.around)) {
        centre_ = instance;
        shown_.insert(instance);
        border.push_back(instance);
    } else if (const Pin* const pin = model.find_pin(request.around)) {
        centre_ = pin;
        if (pin->instance) {
            shown_.insert(pin->instance);
        }
        if (pin->signal && steps > 0) {
            reach(*pin->signal);
            --steps;
            if (pin->instance) {
                border.push_back(pin->instance);
            }
        }
    } else if (const Signal* const signal = model.find_signal(request.around)) {
        centre_ = signal;
        reach(*signal);
    } else {
        problem_ = unknown_name(model, request.around);
    }
    for (; steps > 0 && !border.empty(); --steps) {
        const auto from = std::move(border);
        border.clear();
        follow(from);
    }
}

void GraphView::select_signals(const Model& model, bool whole) {
    for (const Signal* signal : model.sorted_signals()) {
        if (whole || std::any_of(signal->pins.begin(), signal->pins.end(),
                                 [&](const Pin* pin) { return pin->instance && shows(*pin); })) {
            signals_.push_back(signal);
        }
    }
}

void GraphView::make_clusters(const Model& model, const Sources& sources, Cluster cluster) {
    const auto name = [&](const Instance& item) -> std::string {
        switch (cluster) {
        case Cluster::none: break;
        case Cluster::component: return item.component->name;
        case Cluster::file: return item.loaded.known() ? sources.get(item.loaded.source).name : "";
        case Cluster::thread:
            for (const LoadedFunction* function : item.functions) {
                if (function->thread) return function->thread->name;
            }
            break;
        }
        return "";
    };
    std::map<std::string, std::size_t> known;
    for (const auto& component : model.components) {
        for (const auto& item : component->instances) {
            if (!shows(*item)) continue;
            const auto [at, fresh] = known.emplace(name(*item), clusters_.size());
            if (fresh) {
                clusters_.emplace_back(at->first, std::vector<const Instance*>{});
            }
            clusters_[at->second].second.push_back(item.get());
        }
    }
}

}  // namespace hal::tools
