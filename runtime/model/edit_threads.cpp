// SPDX-License-Identifier: MIT
// Threads, and the functions in them.
#include "model/edit.hpp"

#include <algorithm>
#include <iterator>

#include "model/own.hpp"
#include "text/quoting.hpp"

namespace hal {

Thread* Edit::add_thread(Word name, const ThreadOptions& options) {
    if (const Thread* const there = model_.find_thread(name.text)) {
        Diagnostic d{Severity::error,
                     "name-taken",
                     "thread " + hal::quoted(name.text) + " already exists",
                     {{name.span, "second time"}},
                     {}};
        if (there->made.known()) {
            d.labels.push_back({there->made, "created here"});
        }
        diagnostics->add(std::move(d));
        return nullptr;
    }
    for (const char* pin :
         {".time", ".tmax", ".tmax-increased", ".threadbeat", ".missed", ".wakeup"}) {
        if (!name_free(std::string(name.text) + pin, name.span, "pin of this thread")) {
            return nullptr;
        }
    }
    auto owned = std::make_unique<Thread>();
    Thread* const made = owned.get();
    made->name = name.text;
    made->options = options;
    made->made = name.span;
    const auto add = [&](const char* suffix, hal_type type, hal_dir dir, hal_pin& memory,
                         const char* doc, const char* unit) {
        auto pin = own_pin(model_, made->name + suffix, type, dir, memory, doc, unit);
        pin->of_thread = made;
        made->pins.push_back(std::move(pin));
    };
    add(".time", HAL_TYPE_S32, HAL_DIR_OUT, made->time, "execution time of the last cycle", "ns");
    add(".tmax", HAL_TYPE_S32, HAL_DIR_PARAM, made->tmax,
        "longest execution time; set to 0 to reset", "ns");
    add(".tmax-increased", HAL_TYPE_BIT, HAL_DIR_OUT, made->tmax_increased,
        "TRUE when the last cycle was the longest so far", "");
    add(".threadbeat", HAL_TYPE_U32, HAL_DIR_OUT, made->beat, "number of cycles", "");
    add(".missed", HAL_TYPE_U32, HAL_DIR_OUT, made->missed, "missed periods", "");
    add(".wakeup", HAL_TYPE_S32, HAL_DIR_OUT, made->wakeup, "wake-up latency of the last cycle",
        "ns");
    const auto place = std::upper_bound(
        model_.threads.begin(), model_.threads.end(), options.period_ns,
        [](std::int64_t period, const auto& other) { return period < other->options.period_ns; });
    const auto position = place - model_.threads.begin();
    make_room(model_.threads);
    on_undo([this, made] {
        for (const auto& pin : made->pins) {
            model_.pin.erase(pin->name);
        }
        model_.thread.erase(made->name);
        const auto at = owner(model_.threads, made);
        removed_.threads.push_back(std::move(*at));  // it may be running
        model_.threads.erase(at);
    });
    model_.threads.insert(model_.threads.begin() + position, std::move(owned));
    structural_ = true;
    model_.thread.emplace(made->name, made);
    for (const auto& pin : made->pins) {
        model_.pin.emplace(pin->name, pin.get());
    }
    return made;
}

bool Edit::remove_thread(Word name) {
    Thread* const leaving = thread(name);
    if (!leaving) return false;
    while (!leaving->functions.empty()) {
        take_from_thread(*leaving->functions.back());
    }
    while (!leaving->init.empty()) {
        take_from_thread(*leaving->init.back());
    }
    for (const auto& pin : leaving->pins) {
        unlink(*pin);
    }
    const auto at = owner(model_.threads, leaving);
    make_room(removed_.threads);
    on_undo([this, leaving, position = at - model_.threads.begin()] {
        const auto back = owner(removed_.threads, leaving);
        model_.threads.insert(model_.threads.begin() + position, std::move(*back));
        removed_.threads.erase(back);
        model_.thread.emplace(leaving->name, leaving);
        for (const auto& pin : leaving->pins) {
            model_.enter(*pin);
        }
    });
    for (const auto& pin : leaving->pins) {
        model_.leave(*pin);
    }
    model_.thread.erase(leaving->name);
    removed_.threads.push_back(std::move(*at));
    model_.threads.erase(at);
    structural_ = true;
    return true;
}

bool Edit::add_function(Word function_name, Word thread_name, int position, Span position_at,
                        bool init) {
    LoadedFunction* const target = function(function_name);
    Thread* const to = thread(thread_name);
    if (!target || !to) return false;
    if (target->thread) {
        Diagnostic d{Severity::error,
                     "function-in-thread",
                     "function " + hal::quoted(target->name) + " is already in thread " +
                         hal::quoted(target->thread->name),
                     {{function_name.span, "second time"}},
                     {}};
        if (target->added.known()) {
            d.labels.push_back({target->added, "added here"});
        }
        d.help.push_back("a function runs in one thread; remove it first: delf " + target->name +
                         " " + target->thread->name);
        diagnostics->add(std::move(d));
        return false;
    }
    if (init && to->init_done) {
        return fail("init-done", function_name.span,
                    "thread " + hal::quoted(to->name) +
                        " has already made its first pass; the initf function would never run",
                    "too late", "add it before start, or with addf");
    }
    auto& row = init ? to->init : to->functions;
    const auto size = static_cast<int>(row.size());
    if (position == 0) {
        return fail("bad-position", position_at,
                    "invalid position 0: 1 is the first position, -1 the last", "",
                    "omit it to append");
    }
    const int index = position > 0 ? position - 1 : size + 1 + position;
    if (index < 0 || index > size) {
        return fail("bad-position", position_at,
                    "thread " + hal::quoted(to->name) + " has " + std::to_string(size) +
                        (size == 1 ? " function" : " functions") + ", position " +
                        std::to_string(position) + " does not exist",
                    "",
                    "positions 1 to " + std::to_string(size + 1) +
                        " count from the beginning, -1 to -" + std::to_string(size + 1) +
                        " from the end");
    }
    make_room(row);
    on_undo([target, to, init, before = target->added, init_before = target->init] {
        auto& functions = init ? to->init : to->functions;
        functions.erase(std::find(functions.begin(), functions.end(), target));
        target->thread = nullptr;
        target->init = init_before;
        target->added = before;
    });
    row.insert(row.begin() + index, target);
    target->thread = to;
    target->init = init;
    target->added = function_name.span;
    structural_ = true;
    return true;
}

bool Edit::remove_function(Word function_name, Word thread_name) {
    LoadedFunction* const target = function(function_name);
    Thread* const from = thread(thread_name);
    if (!target || !from) return false;
    if (target->thread != from) {
        return fail(
            "not-in-thread", function_name.span,
            "function " + hal::quoted(target->name) + " is not in thread " +
                hal::quoted(from->name),
            "", target->thread ? "it is in thread " + target->thread->name : "it is in no thread");
    }
    take_from_thread(*target);
    return true;
}

void Edit::take_from_thread(LoadedFunction& function) {
    Thread* const from = function.thread;
    if (!from) return;
    const bool init = function.init;
    auto& row = init ? from->init : from->functions;
    const auto at = std::find(row.begin(), row.end(), &function);
    make_room(taken_);
    on_undo([&function, from, init, position = at - row.begin()] {
        auto& functions = init ? from->init : from->functions;
        functions.insert(functions.begin() + position, &function);
        function.thread = from;
        function.init = init;
    });
    row.erase(at);
    function.thread = nullptr;
    taken_.push_back(&function);
    structural_ = true;
}

void Edit::make_taken_safe() {
    const auto runs = [](const LoadedFunction* function) { return function->thread != nullptr; };
    for (const LoadedFunction* const function : taken_) {
        if (function->thread) continue;
        for (const Instance* const instance : function->instances) {
            if (model_.find_instance(instance->name) != instance) continue;  // unloaded
            const bool any_runs =
                std::any_of(instance->functions.begin(), instance->functions.end(), runs);
            for (const auto& pin : instance->pins) {
                const bool is_computed =
                    pin->function ? pin->function->thread != nullptr : any_runs;
                if (is_computed || pin->dir != HAL_DIR_OUT || (pin->flags & HAL_PIN_SAFE) == 0) {
                    continue;
                }
                if (pin->signal) {
                    signal_values.try_emplace(pin->signal, pin->safe);
                } else {
                    pin_values.try_emplace(pin.get(), pin->safe);
                }
            }
        }
    }
}

}  // namespace hal
