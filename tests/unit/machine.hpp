// SPDX-License-Identifier: MIT
// A session for tests: netlist text in, values and diagnostics out. On the virtual clock unless
// asked otherwise.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include "commands/table.hpp"
#include "machine/session.hpp"

namespace hal::test {

enum class Clock { virtual_time, real };

/// Waits for an event, not for a time: the limit only ends a test that would hang for ever.
inline bool eventually(const std::function<bool()>& happened) {
    for (int turn = 0; turn < 60'000; ++turn) {
        if (happened()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

class Machine {
public:
    explicit Machine(Clock clock = Clock::virtual_time) : session(options(clock)) {}

    /// Executes all lines as one transaction. Returns true when it was applied; its messages are in
    /// `said`.
    bool edit(const std::string& text) {
        Diagnostics diagnostics;
        Transaction transaction = session.begin();
        apply(transaction, text, diagnostics);
        const bool good = transaction.commit(diagnostics);
        said = render(diagnostics, session.sources);
        return good;
    }
    /// Applies without committing.
    void apply(Transaction& transaction, const std::string& text, Diagnostics& diagnostics) {
        const auto source = session.sources.add("test.hal", text);
        for (const Command& command :
             parse(session.sources, source, {&session.ini, {}}, diagnostics)) {
            apply_edit(transaction, command, diagnostics);
        }
    }
    /// A transaction that must take effect.
    void must(const std::string& text) { ASSERT_TRUE(edit(text)) << text << "\n" << said; }
    /// Expects the transaction to be rejected with this code and to change nothing.
    void rejected(const std::string& text, const std::string& code) {
        const std::string before = dump();
        EXPECT_FALSE(edit(text)) << text;
        EXPECT_NE(said.find("[" + code + "]"), std::string::npos)
            << "wanted [" << code << "], got:\n"
            << said;
        EXPECT_EQ(before, dump()) << text;
    }

    /// A pin's or signal's value as getp prints it; "?" when there is none of that name.
    std::string get(const std::string& name) {
        const auto reading = session.values().read({name})[0];
        return reading ? format_value(reading->type, reading->value) : "?";
    }
    std::int64_t number(const std::string& name) { return std::stoll(get(name)); }
    /// Several at once, of one cycle where they belong to one thread.
    std::vector<std::string> get_all(const std::vector<std::string>& names) {
        std::vector<std::string> values;
        for (const auto& reading : session.values().read(names)) {
            values.push_back(reading ? format_value(reading->type, reading->value) : "?");
        }
        return values;
    }

    void start() { session.threads().start(); }
    void stop() { session.threads().stop(); }
    void cycles(std::uint64_t count) { session.threads().advance_cycles(count); }

    /// The whole model as text: everything that a transaction may change and a rolled back one must
    /// not.
    std::string dump(bool values = true) {
        std::ostringstream out;
        const Model& model = session.model();
        for (const auto& component : model.components) {
            out << "component " << component->name << " next " << component->next_number;
            for (const std::string& arguments : component->arguments) {
                out << " {" << arguments << "}";
            }
            for (const auto& function : component->functions) {
                out << " f:" << function->name;
            }
            out << "\n";
            for (const auto& instance : component->instances) {
                out << " instance " << instance->name << (instance->started ? " started" : "")
                    << "\n";
                for (const LoadedFunction* function : instance->functions) {
                    out << "  function " << function->name << "\n";
                }
            }
        }
        for (const Pin* pin : model.sorted_pins()) {
            out << "pin " << pin->name << " " << name(pin->type) << " " << name(pin->dir);
            if (!pin->alias.empty()) {
                out << " alias " << pin->alias
                    << (model.find_pin(pin->alias) == pin ? "" : " LOST");
            }
            if (pin->signal) {
                out << " on " << pin->signal->name << (pin->arrow_in ? " in" : "")
                    << (pin->arrow_out ? " out" : "") << " at " << pin->linked_at.begin;
            }
            if (pin->home) {
                out << " home " << pin->home->name;
            }
            if (values && !changing(*pin)) {
                out << " = " << format_exact(pin->type, session.values().read_pins({pin})[0]);
            }
            out << "\n";
        }
        for (const Signal* signal : model.sorted_signals()) {
            out << "signal " << signal->name << " " << name(signal->type) << " readers "
                << signal->readers << " ios " << signal->ios << " writer "
                << (signal->writer ? signal->writer->name : "-")
                << (model.signals[signal->index].get() == signal ? "" : " MISPLACED");
            for (const Pin* pin : signal->pins) {
                out << " " << pin->name;
            }
            if (signal->type == HAL_TYPE_PORT) {
                out << " bytes " << (signal->port ? signal->port->capacity : 0);
            } else if (values && (!signal->writer || !changing(*signal->writer))) {
                out << " = "
                    << format_exact(signal->type, session.values().read_signals({signal})[0]);
            }
            out << "\n";
        }
        for (const auto& thread : model.threads) {
            out << "thread " << thread->name << " " << thread->options.period_ns << " init";
            for (const LoadedFunction* function : thread->init) {
                out << " " << function->name;
            }
            out << " cyclic";
            for (const LoadedFunction* function : thread->functions) {
                out << " " << function->name;
            }
            out << "\n";
        }
        for (const LoadedFunction* function : model.sorted_functions()) {
            out << "function " << function->name << " in "
                << (function->thread ? function->thread->name : "-")
                << (function->init ? " init" : "") << " of";
            for (const Instance* instance : function->instances) {
                out << " " << instance->name;
            }
            out << " steps " << function->steps.size() << "\n";
        }
        out << "indices " << model.component.size() << " " << model.instance.size() << " "
            << model.pin.size() << " " << model.signal.size() << " " << model.function.size() << " "
            << model.thread.size() << "\n";
        return out.str();
    }

    Session session;
    std::string said;

private:
    static SessionOptions options(Clock clock) {
        SessionOptions options;
        options.name = "test";
        options.virtual_clock = clock == Clock::virtual_time;
        options.plugin_path = {HALCYON_TEST_PLUGINS};
        return options;
    }
    // Threads and functions count and measure while the test looks.
    bool changing(const Pin& pin) const {
        if (pin.type == HAL_TYPE_PORT || pin.of_thread || !pin.instance) return true;
        return !session.options().virtual_clock && session.threads().running() &&
               pin.dir != HAL_DIR_IN && pin.dir != HAL_DIR_PARAM;
    }
};

}  // namespace hal::test
