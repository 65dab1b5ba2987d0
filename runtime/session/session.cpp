// SPDX-License-Identifier: MIT
#include "session/session.hpp"

#include <algorithm>

#include "base/keep.hpp"
#include "model/check/check.hpp"
#include "session/construct.hpp"
#include "session/state.hpp"

namespace hal {

Session::State::State(SessionOptions o)
    : options(std::move(o)), plugins(options.plugin_path), executor(std::make_unique<Executor>(options.virtual_clock)) {
    if (!options.virtual_clock && !options.check_only) refused = Executor::prepare_process();
}

Session::State::~State() = default;

Session::Session(SessionOptions options) : state_(std::make_unique<State>(std::move(options))) {
    state_->status.text = status_for_plugins;
    state_->status.data = this;
    if (!state_->options.check_only) watch_for_crashes(state_.get());
}

Session::~Session() {
    shut_down();
    watch_for_crashes(nullptr);
    if (state_->abandoned) keep_for_good(std::move(state_));
}

const SessionOptions& Session::options() const { return state_->options; }
const Model& Session::model() const { return state_->model; }

bool Session::edits(const Command& command) { return is_edit(command); }

void Session::apply(const Command& command, Diagnostics& diagnostics) {
    State& s = *state_;
    try {
        if (!s.reserve) s.reserve = std::make_unique<char[]>(1 << 20);
        if (!s.edit) {
            s.edit = std::make_unique<Edit>(s.model);
            s.commands = 0;
        }
        for (const auto& thread : s.model.threads)
            if (const Core* const core = s.core(thread.get())) thread->init_done = core->passed();
        Elaboration on{s.model, *s.edit, s.plugins, sources, diagnostics, s.auto_orders};
        for (const Command& plain : expand(command, diagnostics)) {
            ++s.commands;
            elaborate(on, plain);
        }
    } catch (const std::bad_alloc&) {
        s.out_of_memory(diagnostics);
    }
}

bool Session::in_transaction() const { return state_->edit != nullptr; }

void Session::abort() {
    if (state_->edit) state_->withdraw();
}

namespace {

// What a single shell line may not yet have right (net comes before addf) is said for whole files only.
void check_all(const Model& model, bool whole, bool complete, Diagnostics& diagnostics) {
    check_periods(model, diagnostics);
    check_spread_pins(model, diagnostics);
    check_arrows(model, diagnostics);
    if (!whole) return;
    // a file that has looked at its values before its first addf is not complete yet
    const bool scheduled =
        std::any_of(model.threads.begin(), model.threads.end(), [](const auto& thread) { return !thread->functions.empty(); });
    if (complete || scheduled) check_unthreaded_functions(model, diagnostics);
    check_cross_thread_io(model, diagnostics);
    check_stale_reads(model, diagnostics);
}

}  // namespace

bool Session::commit(Diagnostics& diagnostics) {
    State& s = *state_;
    if (!s.edit) return !diagnostics.failed();
    bool good = false;
    try {
        good = !diagnostics.failed() && s.carry_out(diagnostics);
    } catch (const std::bad_alloc&) {
        s.out_of_memory(diagnostics);
    }
    if (!good) s.withdraw(&diagnostics);
    return good;
}

bool Session::State::carry_out(Diagnostics& diagnostics) {
    if (!edit->structural() && edit->pin_values.size() + edit->signal_values.size() <= Core::most_writes / 2)
        return write_values(diagnostics);
    apply_auto_order(model, *edit, auto_orders, diagnostics);
    Diagnostics found;
    check_all(model, commands > 1, options.check_only, found);
    for (const Diagnostic& one : found.all()) {
        // an old warning is not said again with every later edit
        if (one.severity == Severity::error || reported.insert(one.message).second) diagnostics.add(one);
    }
    if (diagnostics.failed()) return false;
    if (options.check_only) {  // no thread takes them
        for (const auto& [signal, value] : edit->signal_values) signal->value = value;
        return close_edit(), true;
    }
    if (!all_answer(diagnostics)) return false;

    for (Instance* const instance : edit->added_instances()) {
        if (!instance->constructed || instance->started || model.find_instance(instance->name) != instance)
            continue;  // unloaded again in the same edit
        if (const std::string why = start_instance(*instance, model, *executor, status); !why.empty())
            diagnostics.error("start-failed", instance->loaded,
                              "'" + instance->name + "' (" + instance->component->name + ") cannot start: " + why);
    }
    if (diagnostics.failed()) return false;
    touched = true;
    if (!start_replaced(diagnostics)) return false;
    if (!make_threads(diagnostics) || !end_threads(edit->removed().threads, diagnostics) || !synchronise(diagnostics)) return false;
    stuck.clear();
    close_edit();
    return true;
}

// Values only: straight into the threads' queues, whatever the size of the machine.
bool Session::State::write_values(Diagnostics& diagnostics) {
    std::vector<std::pair<Core*, std::vector<Write>>> rows;
    const auto write = [&](const Thread* thread, hal_value* to, hal_value value) {
        Core* const to_core = core(thread);
        if (!to_core) return;
        auto row = std::find_if(rows.begin(), rows.end(), [&](const auto& one) { return one.first == to_core; });
        if (row == rows.end()) row = rows.insert(row, {to_core, {}});
        row->second.push_back({to, value});
    };
    for (const auto& [pin, value] : edit->pin_values) write(pin->home, pin->memory->slot, value);
    for (const auto& [signal, value] : edit->signal_values) {
        if (signal->cell) continue;
        if (signal->home) write(signal->home, signal->slot, value);
        else
            for (const auto& [thread, copy] : signal->copies) write(thread, copy, value);
    }
    if (!executor->write(rows, answer_timeout_ns)) {
        diagnostics.error("silent-thread", {}, "a thread did not take the new value: one of its functions hangs", "",
                          "show thread and show fault say more");
        return false;
    }
    for (const auto& [signal, value] : edit->signal_values) {
        if (signal->cell) __atomic_store_n(&signal->cell->raw, value.raw, __ATOMIC_RELAXED);
        else if (!signal->home) signal->value = value;
    }
    close_edit();
    return true;
}

void Session::State::out_of_memory(Diagnostics& diagnostics) {
    reserve.reset();
    diagnostics.error("out-of-memory", {}, "there is no memory left for this edit", "",
                      "the machine runs on as it was; 'ulimit -v' and 'ulimit -l' limit a process");
}

// The transaction is over, one way or the other: what is no longer in the model goes.
void Session::State::close_edit() {
    collect_faults();  // before the plugins whose words they use
    auto& removed = edit->removed();
    for (auto it = removed.instances.rbegin(); it != removed.instances.rend(); ++it) destroy_instance(**it);
    auto& replaced = edit->replaced();
    for (auto one = replaced.rbegin(); one != replaced.rend(); ++one)
        for (auto it = one->other->instances.rbegin(); it != one->other->instances.rend(); ++it) destroy_instance(**it);
    edit.reset();
    auto_orders.clear();
    before.pins.clear();
    before.signals.clear();
    touched = false;
}

// --- the machine ----------------------------------------------------------------------------------------------------

void Session::start_threads() {
    for (const auto& [thread, core] : state_->cores) core->clear_stop();
    state_->executor->start();
}

void Session::stop_threads() {
    State& s = *state_;
    if (!s.executor->running()) return;
    s.executor->stop();
    // every thread makes its outputs safe at the end of its next cycle; see it done
    std::deque<Observation> observations;
    std::vector<std::pair<Core*, Observation*>> wishes;
    for (const auto& [thread, core] : s.cores) wishes.emplace_back(core, &observations.emplace_back());
    s.executor->observe(wishes, answer_timeout_ns);
}

bool Session::running() const { return state_->executor->running(); }

void Session::advance_ns(std::int64_t ns) { state_->executor->advance(ns); }

void Session::advance_cycles(std::uint64_t cycles) {
    State& s = *state_;
    if (s.model.threads.empty()) return;
    const Thread& fastest = *s.model.threads.front();
    const Core* const core = s.core(&fastest);
    const std::uint64_t wanted = core->cycles.load() + cycles;
    if (s.executor->is_virtual()) return s.executor->advance_cycles(*core, cycles);
    s.executor->advance(static_cast<std::int64_t>(cycles) * fastest.options.period_ns);
    // under the real clock periods may have been missed: cycles are what was asked for
    for (int turn = 0; turn < 10'000 && core->cycles.load() < wanted; ++turn) s.executor->advance(fastest.options.period_ns);
}

std::int64_t Session::now_ns() const { return state_->executor->now_ns(); }

void Session::shut_down() {
    State& s = *state_;
    if (s.shut) return;
    s.shut = true;
    abort();
    if (s.options.check_only) {
        for (auto c = s.model.components.rbegin(); c != s.model.components.rend(); ++c)
            for (auto i = (*c)->instances.rbegin(); i != (*c)->instances.rend(); ++i) destroy_instance(**i);
        return;
    }
    stop_threads();
    bool all_ended = true;
    for (const auto& [thread, core] : s.cores) all_ended = s.executor->remove(*core, answer_timeout_ns) && all_ended;
    if (!all_ended) {  // a function that hangs may still use its instance: leave everything as it is
        s.abandoned = true;
        return;
    }
    s.cores.clear();
    for (auto c = s.model.components.rbegin(); c != s.model.components.rend(); ++c)
        for (auto i = (*c)->instances.rbegin(); i != (*c)->instances.rend(); ++i) destroy_instance(**i);
}

// --- values ---------------------------------------------------------------------------------------------------------

namespace {

struct Source {
    const hal_value* from;
    const Thread* owner;   // nullptr: the session may read it itself
    bool shared = false;   // the session writes it, too
};

Source source(const Signal& signal) {
    if (signal.cell || !signal.home) return {signal.slot, nullptr};
    return {signal.slot, signal.home, signal.ios != 0};
}

Source source(const Pin& pin) { return pin.signal ? source(*pin.signal) : Source{pin.memory->slot, pin.home, true}; }

// `together`: all values of one thread are of one cycle.
std::vector<hal_value> read_all(Session::State& s, const std::vector<Source>& sources, bool together = true) {
    struct Group {
        std::vector<const hal_value*> from;
        std::vector<std::size_t> at;
        std::vector<hal_value> to;
        Observation wish;
    };
    std::vector<hal_value> values(sources.size());
    std::map<Core*, Group> groups;
    for (std::size_t i = 0; i < sources.size(); ++i) {
        const Source from = sources[i];
        Core* const core = from.owner ? s.core(from.owner) : nullptr;
        // a single value is coherent with itself: no need to wait for the thread, unless it has news of it in its queue
        const bool alone = !together || sources.size() == 1;
        if (!core || (alone && (core->settled() || (!together && !from.shared)))) {
            values[i].raw = __atomic_load_n(&from.from->raw, __ATOMIC_RELAXED);
            continue;
        }
        groups[core].from.push_back(from.from);
        groups[core].at.push_back(i);
    }
    std::vector<std::pair<Core*, Observation*>> wishes;
    for (auto& [core, group] : groups) {
        group.to.resize(group.from.size());
        group.wish.from = group.from.data();
        group.wish.to = group.to.data();
        group.wish.count = group.from.size();
        wishes.emplace_back(core, &group.wish);
    }
    if (!wishes.empty()) s.executor->observe(wishes, answer_timeout_ns);
    for (auto& [core, group] : groups) {
        const bool answered = group.wish.done.load();
        for (std::size_t k = 0; k < group.at.size(); ++k) {
            if (answered) values[group.at[k]] = group.to[k];
            else values[group.at[k]].raw = __atomic_load_n(&group.from[k]->raw, __ATOMIC_RELAXED);  // it hangs: its memory stands still
        }
    }
    return values;
}

template <class Object>
std::vector<Source> sources_of(const std::vector<const Object*>& objects) {
    std::vector<Source> all;
    for (const Object* object : objects) all.push_back(source(*object));
    return all;
}

}  // namespace

std::vector<hal_value> Session::read_pins(const std::vector<const Pin*>& pins) { return read_all(*state_, sources_of(pins)); }
std::vector<hal_value> Session::peek_pins(const std::vector<Pin*>& pins) {
    std::vector<Source> all;
    for (const Pin* const pin : pins) all.push_back(source(*pin));
    return read_all(*state_, all, false);
}
std::vector<hal_value> Session::read_signals(const std::vector<const Signal*>& signals) { return read_all(*state_, sources_of(signals)); }

std::vector<std::optional<Reading>> Session::read(const std::vector<std::string>& names) {
    std::vector<std::optional<Reading>> readings(names.size());
    std::vector<Source> wanted;
    std::vector<std::size_t> at;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (const Pin* const pin = model().find_pin(names[i])) {
            readings[i] = Reading{pin->type, {}};
            wanted.push_back(source(*pin));
        } else if (const Signal* const signal = model().find_signal(names[i])) {
            readings[i] = Reading{signal->type, {}};
            wanted.push_back(source(*signal));
        } else {
            continue;
        }
        at.push_back(i);
    }
    const auto values = read_all(*state_, wanted);
    for (std::size_t k = 0; k < at.size(); ++k) readings[at[k]]->value = values[k];
    return readings;
}

// --- streams, processes -----------------------------------------------------------------------------------------------

hal_stream* Session::find_stream(std::string_view name) const {
    for (const auto& component : model().components)
        for (const auto& instance : component->instances)
            for (const auto& [stream_name, stream] : instance->streams)
                if (stream_name == name) return stream;
    return nullptr;
}

std::vector<std::string> Session::stream_names() const {
    std::vector<std::string> names;
    for (const auto& component : model().components)
        for (const auto& instance : component->instances)
            for (const auto& [name, stream] : instance->streams) names.push_back(name);
    return names;
}

std::vector<std::string> Session::available_components() const { return state_->plugins.available(); }

std::optional<Declared> Session::declared(std::string_view component) const {
    Diagnostics ignored;
    const LoadedComponent* const loaded = model().find_component(component);
    const std::optional<Plugin> plugin =
        loaded && loaded->plugin ? Plugin{loaded->plugin, loaded->library, loaded->path} : state_->plugins.open(component, {}, ignored);
    Declared found;
    std::string problem;
    if (!plugin || !gather(*plugin->component, found, problem)) return {};
    return found;
}

}  // namespace hal
