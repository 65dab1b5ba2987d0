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

}  // namespace

std::vector<LoadedFunction*> dataflow_order(const std::vector<LoadedFunction*>& functions, Span at,
                                            Diagnostics& diagnostics) {
    const std::size_t n = functions.size();
    std::unordered_map<const Signal*, std::vector<std::size_t>> writers;
    for (std::size_t i = 0; i < n; ++i) {
        for_pins(*functions[i], [&](const Pin& pin) {
            if (pin.signal && pin.dir == HAL_DIR_OUT) {
                writers[pin.signal].push_back(i);
            }
        });
    }

    // edges writer -> reader, with the signals that make them
    std::vector<std::vector<std::size_t>> readers(n);
    std::vector<std::map<std::size_t, std::vector<const Signal*>>> waits_for(n);
    for (std::size_t i = 0; i < n; ++i) {
        for_pins(*functions[i], [&](const Pin& pin) {
            if (!pin.signal || pin.dir != HAL_DIR_IN) return;
            const auto from = writers.find(pin.signal);
            if (from == writers.end()) return;
            for (const std::size_t writer : from->second) {
                if (writer == i) continue;
                auto& signals = waits_for[i][writer];
                if (signals.empty()) {
                    readers[writer].push_back(i);
                }
                if (std::find(signals.begin(), signals.end(), pin.signal) == signals.end()) {
                    signals.push_back(pin.signal);
                }
            }
        });
    }

    // (values read too early if it came now, place as written): ready ones have 0 and come in
    // written order
    const auto cost = [&](std::size_t i) {
        std::size_t sum = 0;
        for (const auto& [writer, signals] : waits_for[i]) {
            sum += signals.size();
        }
        return sum;
    };
    std::set<std::pair<std::size_t, std::size_t>> waiting;
    std::vector<std::size_t> costs(n);
    for (std::size_t i = 0; i < n; ++i) {
        waiting.emplace(costs[i] = cost(i), i);
    }
    std::vector<LoadedFunction*> order;
    order.reserve(n);
    while (!waiting.empty()) {
        const std::size_t next = waiting.begin()->second;
        waiting.erase(waiting.begin());
        for (const auto& [writer, signals] : waits_for[next]) {
            for (const Signal* signal : signals) {
                diagnostics.note("cyclic-order", at,
                                 "'" + functions[next]->name + "' reads '" + signal->name +
                                     "' one cycle late: it is in a loop with '" +
                                     functions[writer]->name + "'");
            }
        }
        order.push_back(functions[next]);
        for (const std::size_t reader : readers[next]) {
            const auto edge = waits_for[reader].find(next);
            if (edge == waits_for[reader].end() || !waiting.erase({costs[reader], reader})) {
                continue;
            }
            costs[reader] -= edge->second.size();
            waits_for[reader].erase(edge);
            waiting.emplace(costs[reader], reader);
        }
    }
    return order;
}

}  // namespace hal
