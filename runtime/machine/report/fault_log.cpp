// SPDX-License-Identifier: MIT
#include "machine/report/fault_log.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "execute/executor.hpp"
#include "execute/float_modes.hpp"
#include "execute/violation.hpp"
#include "machine/report/cpu_occupant.hpp"
#include "model/model.hpp"
#include "text/fault_pages.hpp"
#include "text/quoting.hpp"

namespace hal {

const LoadedFunction* function_with_id(const Model& model, std::uint32_t id) {
    for (const auto& component : model.components) {
        for (const auto& function : component->functions) {
            if (function->id == id) return function.get();
        }
    }
    return nullptr;
}

std::string function_text(const LoadedFunction& function) {
    return "function '" + function.name + "' (" + function.component->name + ")";
}

namespace {

constexpr std::size_t kept_faults = 1000;
// of a storm, a thread queues one fault per kind and second
constexpr std::int64_t same_row_ns = 2'000'000'000;

/// A code as its standard writes it: 0x7305.
std::string hexadecimal(double value) {
    char text[32];
    const bool fits = value >= 0 && value < 4294967296.0;
    std::snprintf(text, sizeof text, "0x%04X", fits ? static_cast<unsigned>(value) : 0U);
    return text;
}

const Pin* pin_with_id(const Model& model, std::uint32_t id) {
    for (const auto& component : model.components) {
        for (const auto& instance : component->instances) {
            for (const auto& pin : instance->pins) {
                if (pin->id == id) return pin.get();
            }
        }
    }
    return nullptr;
}

const Instance* instance_at(const Model& model, const void* self) {
    for (const auto& component : model.components) {
        for (const auto& instance : component->instances) {
            const auto* const first = static_cast<const char*>(instance->memory);
            if (self >= first &&
                self < first + (component->plugin ? component->plugin->instance_size : 0)) {
                return instance.get();
            }
        }
    }
    return nullptr;
}

std::string grouped(std::uint64_t number) {
    std::string text = std::to_string(number);
    for (std::size_t at = text.size(); at > 3;) {
        text.insert(at -= 3, " ");
    }
    return text;
}

struct FaultMessage {
    FaultCode code;  // has a page of `hal explain`
    std::string sentence;
};

/// ", last seen in function 'f' (comp)", or nothing when the function is unknown.
std::string in_function(const Model& model, std::uint32_t id) {
    const LoadedFunction* const function = id != 0 ? function_with_id(model, id) : nullptr;
    return function ? ", last seen in " + function_text(*function) : "";
}

std::string limit_of(const Thread& thread) {
    return " (limit " +
           format_duration(static_cast<double>(thread.options.supervision_limit_ns())) + ")";
}

std::string process_gap_text(std::int64_t gap_ns) {
    return "the process got no CPU time for " + format_duration(static_cast<double>(gap_ns)) +
           " (stopped by a signal or a debugger, or the host was busy)";
}

constexpr const char* stopped_and_safe =
    "; the thread's functions are stopped and its outputs were set to their safe values; see: show "
    "thread ";

/// "servo: ready to run, but got no CPU time for 105 ms (limit ...) at cycle 7; ...; what to do"
std::string starved_text(const Thread& thread, std::int64_t starved_ns, int cpu,
                         const std::string& at, const std::string& user) {
    std::string text = thread.name + ": ready to run, but got no CPU time for " +
                       format_duration(static_cast<double>(starved_ns));
    if (!user.empty()) {
        text += ": thread " + user + " uses CPU " + std::to_string(cpu);
    }
    text += limit_of(thread) + at + stopped_and_safe + thread.name + ", start";
    if (user.empty()) {
        text += "; " + starvation_help(cpu);
    }
    return text;
}

FaultMessage exception_message(const Model& model, const Thread& thread, const FaultEvent& event,
                               const std::string& at) {
    const LoadedFunction* const function = function_with_id(model, event.subject);
    const std::string who = function ? function_text(*function) : "a function";
    return {"exception", thread.name + ": " + who + " threw an exception" + at +
                             "; the thread's functions are stopped and its outputs were set to "
                             "their safe values; see: show thread, start"};
}

FaultMessage not_finite_message(const Model& model, const Thread& thread, const FaultEvent& event,
                                const std::string& at) {
    std::string who = "a pin", safe = "0", see;
    if (const Pin* const pin = pin_with_id(model, event.subject)) {
        who = "pin '" + pin->name + "' (" + pin->instance->component->name + ")";
        safe = format_value(HAL_TYPE_FLOAT, pin->safe);
        see = "; see: show pin " + pin->instance->name;
    }
    const std::string value = format_value(HAL_TYPE_FLOAT, hal_value{.real = event.value});
    return {"not-finite",
            thread.name + ": " + who + " became " + value + at + "; it was set to " + safe + see};
}

FaultMessage budget_message(const Model& model, const Thread& thread, const FaultEvent& event,
                            const std::string& at) {
    const std::int64_t budget = thread.options.budget_ns;
    const std::int64_t took = static_cast<std::int64_t>(event.value);
    const bool over_budget = budget > 0 && took > budget;
    const std::string why = over_budget
                                ? "budget " + format_duration(static_cast<double>(budget))
                                : std::to_string(took / thread.options.period_ns) + " periods";
    return {over_budget ? FaultCode("budget") : FaultCode("overrun"),
            thread.name + ": the cycle took " + format_duration(event.value) + " (" + why + ")" +
                in_function(model, event.subject) + at + "; see: show timing " + thread.name};
}

FaultMessage silent_message(const Model& model, const Thread& thread, const FaultEvent& event,
                            const Absence& absence, const std::string& at) {
    if (absence.process_ns == 0 && absence.starved_ns > 0) {
        return {"starved-thread", starved_text(thread, absence.starved_ns, absence.cpu, at, "")};
    }
    std::string what = "no cycle for " + format_duration(event.value);
    if (event.subject != 0) {
        what = "the cycle took " + format_duration(event.value) + in_function(model, event.subject);
    } else if (absence.process_ns > 0) {
        what = process_gap_text(absence.process_ns);
    }
    return {"hung-thread", thread.name + ": " + what + limit_of(thread) + at + stopped_and_safe +
                               thread.name + ", start"};
}

/// "rounding, flush to zero"
std::string modes_text(double differences) {
    constexpr std::pair<FloatModes::Difference, const char*> names[] = {
        {FloatModes::rounding, "rounding"},
        {FloatModes::flush_to_zero, "flush to zero"},
        {FloatModes::denormals_are_zero, "denormals are zero"},
        {FloatModes::traps, "exceptions that trap"},
        {FloatModes::precision, "precision"},
        {FloatModes::default_nan, "default NaN"}};
    std::string text;
    for (const auto& [difference, name] : names) {
        if ((static_cast<unsigned>(differences) & difference) == 0) continue;
        append_item(text, name);
    }
    return text;
}

/// "servo: function 'f' (comp) called fork() at cycle 7; what was done; what to do"
FaultMessage violation_message(const Model& model, const Thread& thread, const FaultEvent& event,
                               const std::string& at) {
    const LoadedFunction* const function = function_with_id(model, event.subject);
    const std::string who = function ? function_text(*function) : "a function";
    std::string text = thread.name + ": " + who + " " + event.reason;
    if (event.reason == violation::float_modes) {
        text += " (" + modes_text(event.value) + ")" + at + "; they were reset";
        text += function ? "; the function must restore them before it returns"
                         : "; it did so in one cycle only, so it is unknown which one it was";
    } else if (event.reason == violation::read_outside) {
        text += at;
    } else if (event.reason == violation::forked) {
        text += at +
                "; the copy of the process was ended; start programs with `loadusr`, or outside of "
                "the cycle";
    } else {
        text += at +
                "; the thread's functions are stopped and its outputs were set to their safe "
                "values; see: show thread, start";
    }
    return {"cycle-violation", text};
}

/// "what happened {}; what was done": the number where the braces are, in {x} hexadecimal, the
/// cycle before the semicolon.
FaultMessage component_message(const Model& model, const Thread& thread, const FaultEvent& event,
                               const std::string& at) {
    std::string what = event.reason ? event.reason : "a fault", done;
    if (const auto semicolon = what.find(';'); semicolon != std::string::npos) {
        done = what.substr(semicolon);
        what.resize(semicolon);
    }
    const std::string number = format_value(HAL_TYPE_FLOAT, hal_value{.real = event.value});
    if (const auto braces = what.find("{}"); braces != std::string::npos) {
        what.replace(braces, 2, number);
    } else if (const auto code = what.find("{x}"); code != std::string::npos) {
        what.replace(code, 3, hexadecimal(event.value));
    } else if (!std::isnan(event.value)) {
        what += " (" + number + ")";
    }
    const Instance* const instance = instance_at(model, event.self);
    if (!instance) return {"component", thread.name + ": " + what + at + done};
    return {"component",
            instance->name + ": " + what + at + done + "; see: show pin " + instance->name};
}

FaultMessage message_of(const Model& model, const Thread& thread, const FaultEvent& event,
                        const Absence& absence) {
    const std::string at = " at cycle " + grouped(event.cycle);
    switch (event.code) {
    case HAL_FAULT_EXCEPTION: return exception_message(model, thread, event, at);
    case HAL_FAULT_NOT_FINITE: return not_finite_message(model, thread, event, at);
    case HAL_FAULT_BUDGET: return budget_message(model, thread, event, at);
    case HAL_FAULT_SILENT_THREAD: return silent_message(model, thread, event, absence, at);
    case HAL_FAULT_COMPONENT: return component_message(model, thread, event, at);
    case HAL_FAULT_VIOLATION: return violation_message(model, thread, event, at);
    case HAL_FAULT_NONE: break;
    }
    return {"component", thread.name + ": a fault" + at};
}

/// Equal for faults that differ in time, measured value and error number only.
std::string kind_of(const Thread& thread, const FaultEvent& event) {
    char self[24];
    std::snprintf(self, sizeof self, " %p ", event.self);
    return thread.name + " " + std::to_string(event.code) + " " + std::to_string(event.subject) +
           self + (event.reason ? event.reason : "");
}

/// "'servo'", or what to call a thread that has ended since.
std::string name_of_thread(const Cores& cores, std::uint32_t id) {
    for (const auto& [thread, core] : cores) {
        if (core->id() == id) return "'" + thread->name + "'";
    }
    return "a thread that is gone";
}

/// What a thread does instead of ending its cycle.
std::string activity(const Stall& stall) {
    switch (stall.cause) {
    case Stall::Cause::busy: return "it uses CPU time (a long computation or an endless loop)";
    case Stall::Cause::waiting: return "it waits in a system call";
    default: break;
    }
    if (stall.tracer == 0) return "stopped by a signal";
    return "stopped by the debugger with process ID " + std::to_string(stall.tracer);
}

/// What kept the thread from ending its cycle.
std::string cause_text(const Model& model, const Stall& stall) {
    if (stall.cause == Stall::Cause::process) return process_gap_text(stall.silent_ns);
    const std::string silent = format_duration(static_cast<double>(stall.silent_ns));
    if (stall.cause == Stall::Cause::suspended) return "the host was suspended for " + silent;
    const LoadedFunction* const function =
        stall.function != 0 ? function_with_id(model, stall.function) : nullptr;
    if (stall.cause == Stall::Cause::ended) {
        return (function ? function_text(*function) : "a function") + " ended its thread";
    }
    const std::string who = function ? function_text(*function) + " has not returned, " : "";
    return who + "no cycle ended for " + silent + ", " + activity(stall);
}

/// What it means for other threads, and what was done about it.
std::string effect_text(const Cores& cores, const Stall& stall) {
    if (stall.starved_count == 0) {
        return stall.demoted ? "; its real-time priority was taken away" : "";
    }
    std::string text = stall.starved_count == 1 ? "; thread " : "; threads ";
    for (std::uint32_t i = 0; i < stall.starved_count; ++i) {
        text += (i == 0 ? "" : ", ") + name_of_thread(cores, stall.starved[i]);
    }
    text += " got no CPU time beside it";
    return text + (stall.demoted ? " until its real-time priority was taken away"
                                 : ", nor get any now: its priority could not be taken away");
}

/// The message of a stall, beginning with the name of the thread.
std::string message_of(const MachineView& machine, const Thread& thread, const Stall& stall) {
    const std::string at = " at cycle " + grouped(stall.cycle);
    if (stall.cause == Stall::Cause::starved) {
        const std::string user =
            stall.occupant != 0 ? name_of_thread(machine.cores, stall.occupant) : "";
        return starved_text(thread, stall.silent_ns, stall.cpu, at, user);
    }
    if (stall.cause == Stall::Cause::ended) {
        return thread.name + ": " + cause_text(machine.model, stall) + at +
               "; its outputs were set to their safe values; end the machine: the thread cannot be "
               "started again";
    }
    return thread.name + ": " + cause_text(machine.model, stall) + limit_of(thread) + at +
           "; the thread's functions are stopped and its outputs were set to their safe values" +
           effect_text(machine.cores, stall) + "; see: show thread " + thread.name;
}

}  // namespace

void FaultLog::add(Row row) {
    row.record.number = ++number_;
    rows_.push_back(std::move(row));
    if (rows_.size() > kept_faults) {
        rows_.pop_front();
    }
}

void FaultLog::collect() {
    for (const auto& thread : machine_.model.threads) {
        collect(*thread);
    }
}

void FaultLog::collect(const Thread& thread) {
    Core* const from = machine_.core(&thread);
    if (!from) return;
    collect_stalls();
    for (FaultEvent event; from->next_fault(event);) {
        const auto again = std::find_if(rows_.rbegin(), rows_.rend(), [&](const Row& row) {
            return event.repeats != 0 && row.event.code != HAL_FAULT_NONE &&
                   row.event.repeats != 0 && row.record.thread == thread.name &&
                   row.event.same(event) && event.time_ns - row.event.last_ns < same_row_ns;
        });
        if (again != rows_.rend()) {
            again->record.count += event.repeats;
            again->record.span_ns = event.last_ns - again->record.age_ns;
            again->event = event;
            continue;
        }
        auto [code, sentence] = message_of(machine_.model, thread, event, absence_of(event, *from));
        FaultRecord record;
        record.cycle = event.cycle;
        record.thread = thread.name;
        record.code = code.name();
        record.sentence = std::move(sentence);
        record.kind = kind_of(thread, event);
        record.varied = event.varied;
        record.age_ns = event.time_ns;
        if (event.repeats != 0) {
            record.count = event.repeats;
            record.span_ns = event.last_ns - event.time_ns;
        }
        add({std::move(record), event, from->condition(event)});
    }
}

Absence FaultLog::absence_of(const FaultEvent& event, const Core& core) const {
    Absence absence;
    if (event.code != HAL_FAULT_SILENT_THREAD) {
        return absence;  // the value may be NaN
    }
    Supervisor& supervisor = machine_.executor.supervisor();
    const auto silent_ns = static_cast<std::int64_t>(event.value);
    absence.cpu = machine_.executor.granted(core).cpu;
    if (event.subject == 0) {
        absence.process_ns = supervisor.process_gap_ns(event.time_ns, silent_ns);
    }
    const std::int64_t delay_ns = supervisor.run_delay_ns(core);
    if (10 * delay_ns > 9 * silent_ns) {
        absence.starved_ns = std::min(delay_ns, silent_ns);
    }
    return absence;
}

void FaultLog::collect_stalls() {
    for (Stall stall; machine_.executor.supervisor().next(stall);) {
        const auto of =
            std::find_if(machine_.cores.begin(), machine_.cores.end(),
                         [&](const auto& one) { return one.second->id() == stall.thread; });
        if (of == machine_.cores.end()) {
            continue;  // the thread has ended since
        }
        FaultRecord record;
        record.age_ns = stall.time_ns;
        record.cycle = stall.cycle;
        record.thread = of->first->name;
        const bool starved = stall.cause == Stall::Cause::starved;
        record.code = (starved ? FaultCode("starved-thread") : FaultCode("hung-thread")).name();
        if (stall.cause == Stall::Cause::ended) {
            record.code = FaultCode("cycle-violation").name();
        }
        record.kind = record.code + " " + record.thread;
        record.sentence = message_of(machine_, *of->first, stall);
        add({std::move(record), {}, of->second->condition({HAL_FAULT_SILENT_THREAD})});
    }
}

void FaultLog::close_rows() {
    for (Row& row : rows_) {
        row.event.code = HAL_FAULT_NONE;
        // another instance may begin one at the same address
        if (!lasts(row)) {
            row.condition = {nullptr, nullptr};
        }
    }
}

bool FaultLog::lasts(const Row& row) const {
    return machine_.executor.board().lasts(row.condition.owner, row.condition.key);
}

/// Returns true if no later record has the condition of `row`.
bool FaultLog::is_newest(const Row& row) const {
    const auto is_same = [&](const Row& other) {
        return other.condition.owner == row.condition.owner &&
               other.condition.key == row.condition.key;
    };
    return &*std::find_if(rows_.rbegin(), rows_.rend(), is_same) == &row;
}

void FaultLog::clear() {
    std::deque<Row> kept;
    for (const Row& row : rows_) {
        if (lasts(row) && is_newest(row)) {
            kept.push_back(row);
        }
    }
    rows_ = std::move(kept);
}

std::vector<FaultRecord> FaultLog::lasting(std::int64_t now_ns) const {
    std::vector<FaultRecord> records;
    for (const Row& row : rows_) {
        if (!lasts(row) || !is_newest(row)) continue;
        records.push_back(row.record);
        records.back().age_ns = now_ns - row.record.age_ns;
        records.back().lasts = true;
    }
    return records;
}

std::vector<FaultRecord> FaultLog::records(std::int64_t now_ns) const {
    std::vector<FaultRecord> records;
    for (const Row& row : rows_) {
        records.push_back(row.record);
        records.back().age_ns = now_ns - row.record.age_ns;
        records.back().lasts = lasts(row) && is_newest(row);
    }
    return records;
}

std::string FaultRecord::subject() const { return sentence.substr(0, sentence.find(" at cycle ")); }

std::string FaultRecord::line() const {
    if (count == 1) return sentence;
    char text[80];
    std::snprintf(
        text, sizeof text, " (%llu times in %.1f s%s)", static_cast<unsigned long long>(count),
        std::max(static_cast<double>(span_ns) * 1e-9, 0.1), varied ? ", with different codes" : "");
    return sentence + text;
}

}  // namespace hal
