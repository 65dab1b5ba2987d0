// SPDX-License-Identifier: MIT
#include <algorithm>

#include "model/check/check.hpp"

namespace hal {
namespace {

// Position of a pin's functions in their thread; positions are looked up once per thread.
template <class Better>
int position(const Pin& pin, Better better) {
    int best = -1;
    const auto look = [&](const LoadedFunction* function) {
        if (!function->thread || function->init) return;
        const auto& row = function->thread->functions;
        const int at = static_cast<int>(std::find(row.begin(), row.end(), function) - row.begin());
        if (best < 0 || better(at, best)) {
            best = at;
        }
    };
    if (pin.function) {
        look(pin.function);
    } else if (pin.instance) {
        for (const LoadedFunction* function : pin.instance->functions) {
            look(function);
        }
    }
    return best;
}

// The same for all pins of a model in linear time.
class Positions {
public:
    explicit Positions(const Model& model) {
        for (const auto& thread : model.threads) {
            for (std::size_t i = 0; i < thread->functions.size(); ++i) {
                at_.emplace(thread->functions[i], static_cast<int>(i));
            }
        }
    }
    template <class Better>
    int of(const Pin& pin, Better better) const {
        int best = -1;
        const auto look = [&](const LoadedFunction* function) {
            const auto at = at_.find(function);
            if (at != at_.end() && (best < 0 || better(at->second, best))) {
                best = at->second;
            }
        };
        if (pin.function) {
            look(pin.function);
        } else if (pin.instance) {
            for (const LoadedFunction* function : pin.instance->functions) {
                look(function);
            }
        }
        return best;
    }

private:
    std::unordered_map<const LoadedFunction*, int> at_;
};

constexpr auto earlier = [](int a, int b) { return a < b; };
constexpr auto later = [](int a, int b) { return a > b; };

}  // namespace

int first_position(const Pin& pin) { return position(pin, earlier); }
int last_position(const Pin& pin) { return position(pin, later); }

std::vector<Delay> delays(const Model& model) {
    const Positions positions(model);
    std::vector<Delay> all;
    for (const auto& signal : model.signals) {
        const Pin* const writer = signal->writer;
        for (const Pin* reader : signal->pins) {
            if (reader == writer || reader->dir != HAL_DIR_IN) continue;
            using Kind = Delay::Kind;
            Kind kind = Kind::session;
            const Thread* const to = thread_of(*reader);
            if (writer) {
                const Thread* const from = thread_of(*writer);
                if (!from || !to) {
                    kind = Kind::unscheduled;
                } else if (from != to) {
                    kind = Kind::other_thread;
                } else {
                    kind = positions.of(*writer, later) < positions.of(*reader, later) ||
                                   writer->of_thread
                               ? Kind::same_cycle
                               : Kind::next_cycle;
                }
            } else if (signal->ios != 0) {
                kind = Kind::cell;
            }
            all.push_back({signal.get(), writer, reader, kind});
        }
    }
    return all;
}

void check_stale_reads(const Model& model, Diagnostics& diagnostics) {
    std::vector<std::string> names;
    Span first;
    for (const Delay& delay : delays(model)) {
        if (delay.kind != Delay::Kind::next_cycle ||
            delay.writer->instance == delay.reader->instance) {
            continue;
        }
        if (!names.empty() && names.back() == delay.signal->name) continue;
        if (names.empty()) {
            first = delay.reader->linked_at;
        }
        names.push_back(delay.signal->name);
    }
    if (names.empty()) return;
    diagnostics.note(
        "stale-read", first,
        names.size() == 1
            ? "signal '" + names.front() +
                  "' is read one cycle late: its reader runs before its writer"
            : std::to_string(names.size()) +
                  " signals are read one cycle late, their readers run before their writers: " +
                  listed(names, 6),
        names.size() == 1 ? "" : "the first",
        "`show latency` shows the delay of every link; `addf --auto` chooses the order");
}

}  // namespace hal
