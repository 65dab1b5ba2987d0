// SPDX-License-Identifier: MIT
// newthread, delthread, addf, initf and delf.
#include <algorithm>
#include <unordered_map>

#include "machine/load/elaborate.hpp"
#include "machine/load/thread_options.hpp"
#include "model/order.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal {

using edits::Args;
using edits::word;

void edits::newthread(Elaboration& on, Args args) {
    NewThread thread;
    if (!parse_new_thread(args, thread, on.diagnostics)) {
        return on.edit.absences().note(args[0].text);
    }
    fit_period(on.model, thread, on.diagnostics);
    on.edit.add_thread({thread.name, thread.at}, thread.options);
}

void edits::delthread(Elaboration& on, Args args) { on.edit.remove_thread(word(args[0])); }

namespace {

void add_automatically(Elaboration& on, Args args) {
    Thread* const thread = on.edit.thread(word(args[0]));
    if (!thread) return;
    AutoOrder order{thread, {}, args[0].span};
    if (args.size() > 1) {
        for (const Token& token : args.subspan(1)) {
            if (on.edit.add_function(word(token), word(args[0]), -1, {}, false)) {
                order.functions.push_back(on.model.find_function(token.text));
            }
        }
    } else {
        for (const auto& component : on.model.components) {
            for (const auto& function : component->functions) {
                if (!function->thread && on.edit.add_function({function->name, args[0].span},
                                                              word(args[0]), -1, {}, false)) {
                    order.functions.push_back(function.get());
                }
            }
        }
        if (order.functions.empty()) {
            on.diagnostics.error("no-such-function", args[0].span,
                                 "every function is already in a thread");
        }
    }
    if (!order.functions.empty()) {
        on.auto_orders.push_back(std::move(order));
    }
}

void place_function(Elaboration& on, Args args, bool init) {
    int position = -1;
    Span position_at;
    if (args.size() > 2) {
        const std::string& text = args[2].text;
        position_at = args[2].span;
        if (!parse_whole(std::string_view(text).substr(text.starts_with('+') ? 1 : 0), position)) {
            on.diagnostics.error("bad-position", position_at,
                                 hal::quoted(text) + " is not a position", "",
                                 "1 is the first place, -1 the last");
            return;
        }
    }
    on.edit.add_function(word(args[0]), word(args[1]), position, position_at, init);
}

}  // namespace

void edits::addf(Elaboration& on, Args args) {
    if (args[0].text == "--auto") return add_automatically(on, args.subspan(1));
    place_function(on, args, false);
}

void edits::initf(Elaboration& on, Args args) { place_function(on, args, true); }

void edits::delf(Elaboration& on, Args args) {
    on.edit.remove_function(word(args[0]), word(args[1]));
}

// Each line's functions among the places they have; each thread is put in order once, however many
// lines there are.
void apply_auto_order(Model&, Edit& edit, const std::vector<AutoOrder>& orders,
                      Diagnostics& diagnostics) {
    struct Row {
        std::vector<LoadedFunction*> functions;
        std::unordered_map<const LoadedFunction*, std::size_t> places;
        bool changed = false;
    };
    std::unordered_map<Thread*, Row> rows;
    for (const AutoOrder& order : orders) {
        if (order.functions.size() < 2) continue;
        const auto [at, fresh] = rows.try_emplace(order.thread);
        Row& row = at->second;
        if (fresh) {
            row.functions = order.thread->functions;
            for (std::size_t i = 0; i < row.functions.size(); ++i) {
                row.places.emplace(row.functions[i], i);
            }
        }
        std::vector<LoadedFunction*> there;
        std::vector<std::size_t> places;
        for (LoadedFunction* const function : order.functions) {
            const auto place = row.places.find(function);
            if (function->thread != order.thread || place == row.places.end()) continue;
            there.push_back(function);
            places.push_back(place->second);
        }
        std::sort(places.begin(), places.end());
        const std::vector<LoadedFunction*> sorted = dataflow_order(there, order.at, diagnostics);
        for (std::size_t i = 0; i < places.size(); ++i) {
            row.functions[places[i]] = sorted[i];
            row.places[sorted[i]] = places[i];
        }
        row.changed = true;
    }
    for (auto& [thread, row] : rows) {
        if (row.changed) {
            edit.reorder(*thread, std::move(row.functions));
        }
    }
}

}  // namespace hal
