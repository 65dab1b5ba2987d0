// SPDX-License-Identifier: MIT
#include "machine/session.hpp"

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "base/keep.hpp"
#include "execute/process_setup.hpp"
#include "text/quoting.hpp"
#include "model/check/check.hpp"
#include "machine/construct.hpp"
#include "machine/crash.hpp"
#include "machine/state.hpp"

namespace hal {

Session::State::State(SessionOptions o)
    : options(std::move(o)), plugins(options.plugin_path), executor(std::make_unique<Executor>(options.virtual_clock)) {
    if (!options.virtual_clock && !options.check_only) refused = prepare_process();
}

Session::State::~State() = default;

Session::Session(SessionOptions options) : state_(std::make_unique<State>(std::move(options))) {
    state_->status.text = status_for_plugins;
    state_->status.data = this;
    if (!state_->options.check_only) watch_for_crashes(state_.get());
}

Session::~Session() {
    shut_down();
    end_watch_for_crashes(state_.get());
    if (state_->abandoned) keep_for_good(std::move(state_));
}

const SessionOptions& Session::options() const { return state_->options; }
const Model& Session::model() const { return state_->model; }

Transaction Session::begin() {
    if (state_->open) throw std::logic_error("a transaction is open already");
    state_->open = true;
    state_->commands = 0;
    return Transaction(*this);
}

bool Session::in_transaction() const { return state_->open; }

Edit& Session::State::editing(Diagnostics& diagnostics) {
    if (!reserve) reserve = std::make_unique<char[]>(1 << 20);
    if (!edit) edit = options.check_only ? std::make_unique<Edit>(model, absences) : std::make_unique<Edit>(model);
    edit->diagnostics = &diagnostics;
    return *edit;
}

namespace {

void elaborate(Elaboration& on, const EditForm& form, const Command& plain) {
    on.edit.diagnostics = &on.diagnostics;
    on.edit.absences().begin(plain.span);
    std::vector<Token> args, counted;
    if (!plain.args.empty() && plain.args[0].text == "=") {  // NAME = VALUE
        args.push_back(plain.name);
        args.insert(args.end(), plain.args.begin() + 1, plain.args.end());
    } else {
        args = plain.args;
    }
    std::copy_if(args.begin(), args.end(), std::back_inserter(counted), [&](const Token& t) { return !form.arrows || !is_arrow(t.text); });
    if (check_arity(form.usage, plain.name, counted, on.diagnostics)) return form.elaborate(on, args);
    if (!args.empty()) on.edit.absences().note(args[0].text);  // what it names may be missing because of this
}

}  // namespace

void Transaction::apply(const EditForm& form, const Command& command, Diagnostics& diagnostics) {
    Session::State& s = *session_->state_;
    try {
        Edit& edit = s.editing(diagnostics);
        for (const auto& thread : s.model.threads)
            if (const Core* const core = s.core(thread.get())) thread->init_done = core->passed();
        Elaboration on{s.model, edit, s.plugins, session_->sources, diagnostics, s.auto_orders, form.usage};
        for (const Command& plain : expand(command, diagnostics)) {
            ++s.commands;
            elaborate(on, form, plain);
        }
    } catch (const std::bad_alloc&) {
        s.out_of_memory(diagnostics);
    }
}

void Transaction::when_committed(std::function<void()> action) { session_->state_->when_committed.push_back(std::move(action)); }

void Transaction::needs_threads() { session_->state_->needs_threads = true; }

void Transaction::roll_back() {
    if (!session_) return;
    Session::State& s = *std::exchange(session_, nullptr)->state_;
    s.when_committed.clear();
    s.needs_threads = false;
    if (s.edit) s.withdraw();
    s.open = false;
}

namespace {

// What a single shell line may not yet have right (net comes before addf) is said for whole files only.
void check_all(const Model& model, bool whole, bool complete, bool open, Diagnostics& diagnostics) {
    check_periods(model, diagnostics);
    check_spread_pins(model, diagnostics);
    check_arrows(model, diagnostics);
    if (!whole) return;
    // a file that has looked at its values before its first addf is not complete yet
    const bool scheduled =
        std::any_of(model.threads.begin(), model.threads.end(), [](const auto& thread) { return !thread->functions.empty(); });
    if ((complete || scheduled) && !open) check_unthreaded_functions(model, diagnostics);
    check_cross_thread_io(model, diagnostics);
    check_stale_reads(model, diagnostics);
}

}  // namespace

bool Transaction::commit(Diagnostics& diagnostics) {
    if (!session_) throw std::logic_error("the transaction has ended already");
    Session& session = *std::exchange(session_, nullptr);
    Session::State& s = *session.state_;
    bool good = false;
    if (s.edit) s.edit->absences().report(diagnostics);
    try {
        if (std::exchange(s.needs_threads, false)) s.all_answer(diagnostics);
        good = !diagnostics.failed() && (!s.edit || s.carry_out(diagnostics));
    } catch (const std::bad_alloc&) {
        s.out_of_memory(diagnostics);
    }
    // Nothing runs under `hal check`: what could be made stays, so that the texts after this one are judged with it.
    if (!good && s.edit && s.options.check_only) s.close_edit();
    else if (!good && s.edit) s.withdraw(&diagnostics);
    s.open = false;
    const auto actions = std::exchange(s.when_committed, {});
    if (good)
        for (const auto& action : actions) action();
    return good;
}

void Session::assume(const std::string& name) { state_->absences.assume(name); }

void Session::note_program(const std::string& program, const std::vector<std::string>& names) {
    const auto cause = state_->absences.add("program " + quoted(program), "which is not started here", {}, Absences::Scope::names);
    for (const std::string& name : names) state_->absences.note(name, cause);
}

void Session::note_missing_text(const std::string& path) {
    state_->absences.add("file " + quoted(path), "which cannot be read", {}, Absences::Scope::file);
}

bool Session::State::carry_out(Diagnostics& diagnostics) {
    if (!edit->structural() && edit->pin_values.size() + edit->signal_values.size() <= Core::most_writes / 2) {
        if (!write_values(edit->pin_values, edit->signal_values, diagnostics)) return false;
        close_edit();
        return true;
    }
    apply_auto_order(model, *edit, auto_orders, diagnostics);
    Diagnostics found;
    check_all(model, commands > 1, options.check_only, edit->absences().open(), found);
    for (const Diagnostic& one : found.all()) {
        // an old warning is not said again with every later edit
        if (reported.insert(one.message).second || (one.severity == Severity::error && !options.check_only)) diagnostics.add(one);
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
bool Session::State::write_values(const Notes<Pin, hal_value>& pins, const Notes<Signal, hal_value>& signals,
                                  Diagnostics& diagnostics) {
    std::vector<std::pair<Core*, std::vector<Write>>> rows;
    const auto write = [&](const Thread* thread, hal_value* to, hal_value value) {
        Core* const to_core = core(thread);
        if (!to_core) return;
        auto row = std::find_if(rows.begin(), rows.end(), [&](const auto& one) { return one.first == to_core; });
        if (row == rows.end()) row = rows.insert(row, {to_core, {}});
        row->second.push_back({to, value});
    };
    for (const auto& [pin, value] : pins) write(pin->home, pin->memory->slot, value);
    for (const auto& [signal, value] : signals) {
        if (signal->cell) continue;
        if (signal->home) write(signal->home, signal->slot, value);
        else
            for (const auto& [thread, copy] : signal->copies) write(thread, copy, value);
    }
    for (const auto& [thread, one] : cores)
        if (one->hung() && std::any_of(rows.begin(), rows.end(), [one = one](const auto& row) { return row.first == one; }))
            hung_thread(*thread, *one, diagnostics);
    if (diagnostics.failed()) return false;
    if (!executor->write(rows, answer_timeout_ns)) {
        diagnostics.error("silent-thread", {}, "a thread did not take the new value: one of its functions hangs", "",
                          "show thread and show fault say more");
        return false;
    }
    for (const auto& [signal, value] : signals) {
        if (signal->cell) __atomic_store_n(&signal->cell->raw, value.raw, __ATOMIC_RELAXED);
        else if (!signal->home) signal->value = value;
    }
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
    if (!removed.instances.empty() || !edit->replaced().empty())
        for (LoggedFault& fault : fault_log) fault.event.code = HAL_FAULT_NONE;  // another instance may soon be where theirs was
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

bool Session::start_threads(Diagnostics* diagnostics) {
    State& s = *state_;
    Diagnostics ignored;
    if (hung_threads(diagnostics ? *diagnostics : ignored)) return false;
    bool all = true;
    for (const auto& [thread, core] : s.cores)
        if (!s.executor->reset(*core)) {
            s.hung_thread(*thread, *core, diagnostics ? *diagnostics : ignored);
            all = false;
        }
    if (all) s.executor->start();
    return all;
}

bool Session::hung_threads(Diagnostics& diagnostics) const {
    bool any = false;
    for (const auto& thread : model().threads)
        if (const Core* const core = state_->core(thread.get()); core && core->hung()) {
            state_->hung_thread(*thread, *core, diagnostics);
            any = true;
        }
    return any;
}

bool Session::stop_threads(Diagnostics* diagnostics) {
    State& s = *state_;
    Diagnostics ignored;
    if (!s.executor->running()) return !hung_threads(diagnostics ? *diagnostics : ignored);
    s.executor->stop();
    // every thread makes its outputs safe at the end of its next cycle; see it done
    std::deque<Observation> observations;
    std::vector<std::pair<Core*, Observation*>> wishes;
    for (const auto& [thread, core] : s.cores) wishes.emplace_back(core, &observations.emplace_back());
    const bool answered = s.executor->observe(wishes, answer_timeout_ns);
    if (hung_threads(diagnostics ? *diagnostics : ignored)) return false;
    if (answered) return true;
    if (diagnostics)  // not supervised, or a long period of supervision
        diagnostics->error("silent-thread", {}, "a thread did not stop within " + format_duration(static_cast<double>(answer_timeout_ns)),
                           "", "show thread and show fault say more");
    return false;
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
    s.when_committed.clear();
    s.needs_threads = false;
    if (s.edit) s.withdraw();
    if (s.options.check_only) {
        for (auto c = s.model.components.rbegin(); c != s.model.components.rend(); ++c)
            for (auto i = (*c)->instances.rbegin(); i != (*c)->instances.rend(); ++i) destroy_instance(**i);
        return;
    }
    stop_threads();
    bool all_ended = true;
    for (const auto& [thread, core] : s.cores) {
        if (s.executor->remove(*core, answer_timeout_ns)) continue;
        s.executor->abandon(*core);
        all_ended = false;
    }
    if (!all_ended) {  // a function that hangs may still use its instance: leave everything as it is, and a watchdog to its time-out
        s.abandoned = true;
        return;
    }
    s.cores.clear();
    s.disarm_watchdog();
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

// Of an open transaction: where the value is that the object would have now if the transaction took effect.
Source source(const Session::State& s, const Pin& pin);

Source source(const Session::State& s, const Signal& signal) {
    if (s.edit) {
        if (const auto set = s.edit->signal_values.find(&signal); set != s.edit->signal_values.end()) return {&set->second, nullptr};
        if (const auto from = s.edit->inherited.find(&signal); from != s.edit->inherited.end()) {
            const auto own = s.edit->pin_values.find(from->second);
            if (own != s.edit->pin_values.end()) return {&own->second, nullptr};
            return {s.edit->present(*from->second).slot, from->second->home, true};
        }
    }
    if (signal.cell || !signal.home) return {signal.slot, nullptr};
    return {signal.slot, signal.home, signal.ios != 0};
}

Source source(const Session::State& s, const Pin& pin) {
    if (pin.signal) return source(s, *pin.signal);
    if (!s.edit) return {pin.memory->slot, pin.home, true};
    if (const auto own = s.edit->pin_values.find(&pin); own != s.edit->pin_values.end()) return {&own->second, nullptr};
    return {s.edit->present(pin).slot, pin.home, true};
}

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
std::vector<Source> sources_of(const Session::State& s, const std::vector<const Object*>& objects) {
    std::vector<Source> all;
    for (const Object* object : objects) all.push_back(source(s, *object));
    return all;
}

}  // namespace

std::vector<hal_value> Session::read_pins(const std::vector<const Pin*>& pins) { return read_all(*state_, sources_of(*state_, pins)); }
std::vector<hal_value> Session::peek_pins(const std::vector<Pin*>& pins) {
    std::vector<Source> all;
    for (const Pin* const pin : pins) all.push_back(source(*state_, *pin));
    return read_all(*state_, all, false);
}
std::vector<hal_value> Session::read_signals(const std::vector<const Signal*>& signals) { return read_all(*state_, sources_of(*state_, signals)); }

std::vector<std::optional<Reading>> Session::read(const std::vector<std::string>& names) {
    std::vector<std::optional<Reading>> readings(names.size());
    std::vector<Source> wanted;
    std::vector<std::size_t> at;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (const Pin* const pin = model().find_pin(names[i])) {
            readings[i] = Reading{pin->type, {}};
            wanted.push_back(source(*state_, *pin));
        } else if (const Signal* const signal = model().find_signal(names[i])) {
            readings[i] = Reading{signal->type, {}};
            wanted.push_back(source(*state_, *signal));
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
