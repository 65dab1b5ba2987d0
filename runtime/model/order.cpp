// SPDX-License-Identifier: MIT
#include "model/order.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <unordered_map>

namespace hal {
namespace {

// Pins a function uses: those that name it, and those of its instances that name none.
template <class Action>
void for_pins(const LoadedFunction& function, Action action) {
    for (const Instance* instance : function.instances) {
        for (const auto& pin : instance->pins) {
            if (!pin->function || pin->function == &function) {
                action(*pin);
            }
        }
    }
}

/// Functions and which of them reads what another one writes. A function is named by its index in
/// the written order.
class DataFlow {
public:
    explicit DataFlow(const std::vector<LoadedFunction*>& functions)
        : functions_(functions), readers_(functions.size()), waits_for_(functions.size()) {
        for (std::size_t i = 0; i < functions.size(); ++i) {
            for_pins(*functions[i], [&](const Pin& pin) {
                if (pin.signal && pin.dir == HAL_DIR_OUT) {
                    writers_[pin.signal].push_back(i);
                }
            });
        }
        for (std::size_t i = 0; i < functions.size(); ++i) {
            for_pins(*functions[i], [&](const Pin& pin) {
                if (pin.signal && pin.dir == HAL_DIR_IN) {
                    add_reader(i, *pin.signal);
                }
            });
        }
    }

    /// Takes the functions one by one: next is the one that reads the fewest values too early, and
    /// of several the first as written. Notes those values.
    std::vector<LoadedFunction*> order(Span at, Diagnostics& diagnostics) {
        for (std::size_t i = 0; i < functions_.size(); ++i) {
            early_.push_back(early_values(i));
            waiting_.emplace(early_[i], i);
        }
        std::vector<LoadedFunction*> order;
        order.reserve(functions_.size());
        while (!waiting_.empty()) {
            const std::size_t next = waiting_.begin()->second;
            waiting_.erase(waiting_.begin());
            note_early_values(next, at, diagnostics);
            order.push_back(functions_[next]);
            for (const std::size_t reader : readers_[next]) {
                release(reader, next);
            }
        }
        return order;
    }

private:
    void add_reader(std::size_t reader, const Signal& signal) {
        const auto writers = writers_.find(&signal);
        if (writers == writers_.end()) return;
        for (const std::size_t writer : writers->second) {
            if (writer == reader) continue;
            auto& signals = waits_for_[reader][writer];
            if (signals.empty()) {
                readers_[writer].push_back(reader);
            }
            if (std::ranges::find(signals, &signal) == signals.end()) {
                signals.push_back(&signal);
            }
        }
    }

    /// Returns how many values the function would read too early if it came now.
    std::size_t early_values(std::size_t reader) const {
        std::size_t sum = 0;
        for (const auto& [writer, signals] : waits_for_[reader]) {
            sum += signals.size();
        }
        return sum;
    }

    void note_early_values(std::size_t reader, Span at, Diagnostics& diagnostics) const {
        for (const auto& [writer, signals] : waits_for_[reader]) {
            for (const Signal* signal : signals) {
                diagnostics.note("cyclic-order", at,
                                 "'" + functions_[reader]->name + "' reads '" + signal->name +
                                     "' one cycle late: it is in a loop with '" +
                                     functions_[writer]->name + "'");
            }
        }
    }

    /// The reader no longer waits for the writer.
    void release(std::size_t reader, std::size_t writer) {
        const auto edge = waits_for_[reader].find(writer);
        if (edge == waits_for_[reader].end()) return;
        if (waiting_.erase({early_[reader], reader}) == 0) return;
        early_[reader] -= edge->second.size();
        waits_for_[reader].erase(edge);
        waiting_.emplace(early_[reader], reader);
    }

    const std::vector<LoadedFunction*>& functions_;
    std::unordered_map<const Signal*, std::vector<std::size_t>> writers_;
    std::vector<std::vector<std::size_t>> readers_;
    std::vector<std::map<std::size_t, std::vector<const Signal*>>> waits_for_;
    std::vector<std::size_t> early_;  // values that the function would read too early
    std::set<std::pair<std::size_t, std::size_t>> waiting_;  // early values, function
};

}  // namespace

std::vector<LoadedFunction*> dataflow_order(const std::vector<LoadedFunction*>& functions, Span at,
                                            Diagnostics& diagnostics) {
    return DataFlow(functions).order(at, diagnostics);
}

}  // namespace hal
