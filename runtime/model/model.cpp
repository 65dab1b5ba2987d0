// SPDX-License-Identifier: MIT
#include "model/model.hpp"

#include <algorithm>
#include <functional>
#include <string_view>
#include <unordered_set>

#include "text/natural_order.hpp"

namespace hal {
namespace {

template <class T>
std::vector<const T*> sorted(std::vector<const T*> all) {
    std::sort(all.begin(), all.end(),
              [](const T* a, const T* b) { return natural_less(a->name, b->name); });
    return all;
}

}  // namespace

struct Model::Texts {
    struct Hash {
        using is_transparent = void;
        std::size_t operator()(std::string_view text) const {
            return std::hash<std::string_view>{}(text);
        }
    };
    std::unordered_set<std::string, Hash, std::equal_to<>> all;
};

Pin* Model::find_pin(std::string_view name) const { return pin.find(name); }
Signal* Model::find_signal(std::string_view name) const { return signal.find(name); }
LoadedFunction* Model::find_function(std::string_view name) const { return function.find(name); }
Thread* Model::find_thread(std::string_view name) const { return thread.find(name); }
Instance* Model::find_instance(std::string_view name) const { return instance.find(name); }

LoadedComponent* Model::find_component(std::string_view name) const {
    if (LoadedComponent* const exact = component.find(name)) return exact;
    const auto same = [](char a, char b) {
        return a == b || (a == '-' && b == '_') || (a == '_' && b == '-');
    };
    for (const auto& candidate : components) {
        if (std::equal(name.begin(), name.end(), candidate->name.begin(), candidate->name.end(),
                       same)) {
            return candidate.get();
        }
    }
    return nullptr;
}

void Model::enter(Pin& entering) {
    pin.emplace(entering.name, &entering);
    if (!entering.alias.empty()) {
        pin.emplace(entering.alias, &entering);
    }
}

void Model::leave(const Pin& leaving) {
    pin.erase(leaving.name);
    if (!leaving.alias.empty()) {
        pin.erase(leaving.alias);
    }
}

std::vector<const Pin*> Model::sorted_pins() const {
    std::vector<const Pin*> all;
    all.reserve(pin.size());
    for (const auto& [name, p] : pin) {
        if (name == p->name) {
            all.push_back(p);
        }
    }
    return sorted(std::move(all));
}

std::vector<const Signal*> Model::sorted_signals() const {
    std::vector<const Signal*> all;
    all.reserve(signals.size());
    for (const auto& s : signals) {
        all.push_back(s.get());
    }
    return sorted(std::move(all));
}

std::vector<const LoadedFunction*> Model::sorted_functions() const {
    std::vector<const LoadedFunction*> all;
    all.reserve(function.size());
    for (const auto& [name, f] : function) {
        all.push_back(f);
    }
    return sorted(std::move(all));
}

const char* Model::keep(std::string_view text) {
    if (!texts_) {
        texts_ = std::make_shared<Texts>();
    }
    const auto known = texts_->all.find(text);
    if (known != texts_->all.end()) return known->c_str();
    return texts_->all.emplace(text).first->c_str();
}

void Model::sweep(std::vector<bool>& in_use) {
    std::unordered_set<const char*> used;
    const auto mark = [&](Span span) {
        if (span.source >= in_use.size()) {
            in_use.resize(span.source + 1);
        }
        in_use[span.source] = true;
    };
    for (const auto& [name, one] : pin) {
        mark(one->linked_at);
        used.insert(one->doc);
        used.insert(one->unit);
    }
    for (const auto& one : signals) {
        mark(one->made);
        mark(one->typed);
    }
    for (const auto& [name, one] : function) {
        mark(one->added);
        used.insert(one->doc);
    }
    for (const auto& one : threads) {
        mark(one->made);
    }
    for (const auto& loaded : components) {
        mark(loaded->loaded);
        for (const auto& one : loaded->instances) {
            mark(one->loaded);
        }
    }
    if (texts_) {
        std::erase_if(texts_->all,
                      [&](const std::string& text) { return !used.contains(text.c_str()); });
    }
}

Model Model::beside() {
    keep("");
    Model other;
    other.texts_ = texts_;
    other.next_id = next_id;
    return other;
}

Thread* thread_of(const Pin& pin) {
    if (pin.of_thread) return pin.of_thread;
    if (pin.function) return pin.function->thread;
    if (pin.instance) {
        for (const LoadedFunction* function : pin.instance->functions) {
            if (function->thread) return function->thread;
        }
    }
    return nullptr;
}

bool is_loose(const Pin& pin) {
    return pin.instance && pin.instance->component->plugin &&
           (pin.instance->component->plugin->flags & HAL_COMPONENT_LOOSE_PINS);
}

}  // namespace hal
