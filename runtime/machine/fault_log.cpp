// SPDX-License-Identifier: MIT
#include "machine/fault_log.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "machine/cpu_occupant.hpp"
#include "machine/state.hpp"
#include "text/fault_pages.hpp"

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

FaultMessage message_of(const Model& model, const Thread& thread, const FaultEvent& event,
                        const Absence& absence) {
    const std::string at = " at cycle " + grouped(event.cycle);
    switch (event.code) {
    case HAL_FAULT_EXCEPTION: {
        const LoadedFunction* const function = function_with_id(model, event.subject);
        const std::string who =
            function ? "function '" + function->name + "' (" + function->component->name + ")"
                     : "a function";
        return {"exception", thread.name + ": " + who + " threw an exception" + at +
                                 "; the thread's functions are stopped and its outputs were set to "
                                 "their safe values; see: show thread, start"};
    }
    case HAL_FAULT_NOT_FINITE: {
        const Pin* const pin = pin_with_id(model, event.subject);
        const std::string who =
            pin ? "pin '" + pin->name + "' (" + pin->instance->component->name + ")" : "a pin";
        const std::string to = pin ? format_value(HAL_TYPE_FLOAT, pin->safe) : "0";
        return {"not-finite", thread.name + ": " + who + " became " +
                                  format_value(HAL_TYPE_FLOAT, hal_value{.real = event.value}) +
                                  at + "; it was set to " + to +
                                  (pin ? "; see: show pin " + pin->instance->name : "")};
    }
    case HAL_FAULT_BUDGET: {
        const std::int64_t budget = thread.options.budget_ns;

        const std::int64_t took = static_cast<std::int64_t>(event.value);
        const bool over_budget = budget > 0 && took > budget;
        const std::string why = over_budget
                                    ? "budget " + format_duration(static_cast<double>(budget))
                                    : std::to_string(took / thread.options.period_ns) + " periods";
        return {over_budget ? FaultCode("budget") : FaultCode("overrun"),
                thread.name + ": the cycle took " + format_duration(event.value) + " (" + why +
                    ")" + in_function(model, event.subject) + at + "; see: show timing " +
                    thread.name};
    }
    case HAL_FAULT_SILENT_THREAD:
        if (absence.process_ns == 0 && absence.starved_ns > 0) {
            return {"starved-thread",
                    starved_text(thread, absence.starved_ns, absence.cpu, at, "")};
        }
        return {"hung-thread",
                thread.name + ": " +
                    (event.subject != 0 ? "the cycle took " + format_duration(event.value) +
                                              in_function(model, event.subject)
                     : absence.process_ns > 0
                         ? "the process got no CPU time for " +
                               format_duration(static_cast<double>(absence.process_ns)) +
                               " (stopped by a signal or a debugger, or the host was busy)"
                         : "no cycle for " + format_duration(event.value)) +
                    limit_of(thread) + at + stopped_and_safe + thread.name + ", start"};
    case HAL_FAULT_COMPONENT: {
        const Instance* const instance = instance_at(model, event.self);
        // "what happened {}; what was done": the number where the braces are, in {x} hexadecimal,
        // the cycle before the semicolon
        std::string what = event.reason ? event.reason : "a fault", done;
        const std::string number = format_value(HAL_TYPE_FLOAT, hal_value{.real = event.value});
        if (const auto semicolon = what.find(';'); semicolon != std::string::npos) {
            done = what.substr(semicolon);
            what.resize(semicolon);
        }
        if (const auto braces = what.find("{}"); braces != std::string::npos) {
            what.replace(braces, 2, number);
        } else if (const auto code = what.find("{x}"); code != std::string::npos) {
            what.replace(code, 3, hexadecimal(event.value));
        } else if (!std::isnan(event.value)) {
            what += " (" + number + ")";
        }
        return {"component", (instance ? instance->name + ": " : thread.name + ": ") + what + at +
                                 done + (instance ? "; see: show pin " + instance->name : "")};
    }
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

/// What kept the thread from ending its cycle, beginning with its name.
std::string message_of(const SessionState& s, const Thread& thread, const Stall& stall) {
    const auto name_of = [&](std::uint32_t id) -> std::string {
        for (const auto& [one, core] : s.cores) {
            if (core->id() == id) return "'" + one->name + "'";
        }
        return "a thread that is gone";
    };
    if (stall.cause == Stall::Cause::starved) {
        return starved_text(thread, stall.silent_ns, stall.cpu, " at cycle " + grouped(stall.cycle),
                            stall.occupant != 0 ? name_of(stall.occupant) : "");
    }
    const std::string silent = format_duration(static_cast<double>(stall.silent_ns));
    const LoadedFunction* const function =
        stall.function != 0 ? function_with_id(s.model, stall.function) : nullptr;
    std::string text = thread.name + ": ";
    using enum Stall::Cause;
    switch (stall.cause) {
    case process:
        text += "the process got no CPU time for " + silent +
                " (stopped by a signal or a debugger, or the host was busy)";
        break;
    case suspended: text += "the host was suspended for " + silent; break;
    case busy:
    case waiting:
    case stopped:
    case starved:  // is another message
        text += (function ? function_text(*function) + " has not returned, no cycle ended for "
                          : "no cycle ended for ") +
                silent;
        if (stall.cause == busy) {
            text += ", it uses CPU time (a long computation or an endless loop)";
        } else if (stall.cause == waiting) {
            text += ", it waits in a system call";
        } else if (stall.tracer != 0) {
            text += ", stopped by the debugger with process ID " + std::to_string(stall.tracer);
        } else {
            text += std::string(", stopped by a signal");
        }
        break;
    }
    text += limit_of(thread) + " at cycle " + grouped(stall.cycle);
    text += "; the thread's functions are stopped and its outputs were set to their safe values";
    if (stall.starved_count != 0) {
        text += stall.starved_count == 1 ? "; thread " : "; threads ";
        for (std::uint32_t i = 0; i < stall.starved_count; ++i) {
            text += (i == 0 ? "" : ", ") + name_of(stall.starved[i]);
        }
        text += std::string(" got no CPU time beside it") +
                (stall.demoted ? " until its real-time priority was taken away"
                               : ", nor get any now: its priority could not be taken away");
    } else if (stall.demoted) {
        text += "; its real-time priority was taken away";
    }
    return text + "; see: show thread " + thread.name;
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
    for (const auto& thread : state_.model.threads) {
        collect(*thread);
    }
}

void FaultLog::collect(const Thread& thread) {
    Core* const from = state_.core(&thread);
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
        auto [code, sentence] = message_of(state_.model, thread, event, absence_of(event, *from));
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
    Supervisor& supervisor = state_.executor->supervisor();
    const auto silent_ns = static_cast<std::int64_t>(event.value);
    absence.cpu = state_.executor->granted(core).cpu;
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
    for (Stall stall; state_.executor->supervisor().next(stall);) {
        const auto of =
            std::find_if(state_.cores.begin(), state_.cores.end(),
                         [&](const auto& one) { return one.second->id() == stall.thread; });
        if (of == state_.cores.end()) {
            continue;  // the thread has ended since
        }
        FaultRecord record;
        record.age_ns = stall.time_ns;
        record.cycle = stall.cycle;
        record.thread = of->first->name;
        const bool starved = stall.cause == Stall::Cause::starved;
        record.code = (starved ? FaultCode("starved-thread") : FaultCode("hung-thread")).name();
        record.kind = record.code + " " + record.thread;
        record.sentence = message_of(state_, *of->first, stall);
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
    return state_.executor->board().lasts(row.condition.owner, row.condition.key);
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
