// SPDX-License-Identifier: MIT
// What the session tells of the machine: threads, faults, delays, privileges.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "hal/privilege.hpp"
#include "machine/construct.hpp"
#include "machine/state.hpp"
#include "model/check/check.hpp"
#include "text/fault_pages.hpp"

namespace hal {
namespace {

constexpr std::size_t kept_faults = 1000;
constexpr std::int64_t same_row_ns = 2'000'000'000;  // of a storm, a thread queues one fault per kind and second

/// A code as its standard writes it: 0x7305.
std::string hexadecimal(double value) {
    char text[32];
    const bool fits = value >= 0 && value < 4294967296.0;
    std::snprintf(text, sizeof text, "0x%04X", fits ? static_cast<unsigned>(value) : 0U);
    return text;
}

std::string policy_text(const Granted& granted, bool virtual_clock) {
    if (virtual_clock) return "virtual clock";
    if (granted.policy == Granted::Policy::fifo) return "SCHED_FIFO " + std::to_string(granted.priority);
    if (granted.policy == Granted::Policy::deadline) return "SCHED_DEADLINE";
    return granted.refused ? "SCHED_OTHER (no privilege)" : "SCHED_OTHER";
}

const LoadedFunction* function_with_id(const Model& model, std::uint32_t id) {
    for (const auto& component : model.components)
        for (const auto& function : component->functions)
            if (function->id == id) return function.get();
    return nullptr;
}

const Pin* pin_with_id(const Model& model, std::uint32_t id) {
    for (const auto& component : model.components)
        for (const auto& instance : component->instances)
            for (const auto& pin : instance->pins)
                if (pin->id == id) return pin.get();
    return nullptr;
}

const Instance* instance_at(const Model& model, const void* self) {
    for (const auto& component : model.components)
        for (const auto& instance : component->instances) {
            const auto* const first = static_cast<const char*>(instance->memory);
            if (self >= first && self < first + (component->plugin ? component->plugin->instance_size : 0)) return instance.get();
        }
    return nullptr;
}

std::string grouped(std::uint64_t number) {
    std::string text = std::to_string(number);
    for (std::size_t at = text.size(); at > 3;) text.insert(at -= 3, " ");
    return text;
}

struct Worded {
    FaultCode code;  // has a page of `hal explain`
    std::string sentence;
};

std::string function_text(const LoadedFunction& function) { return "function '" + function.name + "' (" + function.component->name + ")"; }

/// ", in function 'f' (comp)", or nothing when it is not known.
std::string in_function(const Model& model, std::uint32_t id) {
    const LoadedFunction* const function = id != 0 ? function_with_id(model, id) : nullptr;
    return function ? ", last seen in " + function_text(*function) : "";
}

std::string limit_of(const Thread& thread) {
    return " (limit " + format_duration(static_cast<double>(thread.options.supervision_limit_ns())) + ")";
}

constexpr const char* stopped_and_safe = "; the thread's functions are stopped and its outputs were set to their safe values; see: show thread ";

/// `stopped_ns`: the whole process was not run for so long before the event.
Worded worded(const Model& model, const Thread& thread, const FaultEvent& event, std::int64_t stopped_ns) {
    const std::string at = " at cycle " + grouped(event.cycle);
    switch (event.code) {
    case HAL_FAULT_EXCEPTION: {
        const LoadedFunction* const function = function_with_id(model, event.subject);
        const std::string who = function ? "function '" + function->name + "' (" + function->component->name + ")" : "a function";
        return {"exception",
                thread.name + ": " + who + " threw an exception" + at +
                    "; the thread's functions are stopped and its outputs were set to their safe values; see: show thread, start"};
    }
    case HAL_FAULT_NOT_FINITE: {
        const Pin* const pin = pin_with_id(model, event.subject);
        const std::string who = pin ? "pin '" + pin->name + "' (" + pin->instance->component->name + ")" : "a pin";
        const std::string to = pin ? format_value(HAL_TYPE_FLOAT, pin->safe) : "0";
        return {"not-finite", thread.name + ": " + who + " became " + format_value(HAL_TYPE_FLOAT, hal_value{.real = event.value}) + at +
                                  "; it was set to " + to + (pin ? "; see: show pin " + pin->instance->name : "")};
    }
    case HAL_FAULT_BUDGET: {
        const std::int64_t budget = thread.options.budget_ns, took = static_cast<std::int64_t>(event.value);
        const bool over_budget = budget > 0 && took > budget;
        const std::string why = over_budget ? "budget " + format_duration(static_cast<double>(budget))
                                            : std::to_string(took / thread.options.period_ns) + " periods";
        return {over_budget ? FaultCode("budget") : FaultCode("overrun"), thread.name + ": the cycle took " + format_duration(event.value) + " (" + why + ")" +
                                                        in_function(model, event.subject) + at + "; see: show timing " + thread.name};
    }
    case HAL_FAULT_SILENT_THREAD:
        return {"hung-thread", thread.name + ": " +
                                   (event.subject != 0 ? "the cycle took " + format_duration(event.value) + in_function(model, event.subject)
                                    : stopped_ns > 0   ? "the process got no CPU time for " + format_duration(static_cast<double>(stopped_ns)) +
                                                           " (stopped by a signal or a debugger, or the host was busy)"
                                                       : "no cycle for " + format_duration(event.value)) +
                                   limit_of(thread) + at + stopped_and_safe + thread.name + ", start"};
    case HAL_FAULT_COMPONENT: {
        const Instance* const instance = instance_at(model, event.self);
        // "what happened {}; what was done": the number where the braces are, in {x} hexadecimal, the cycle before the semicolon
        std::string what = event.reason ? event.reason : "a fault", done;
        const std::string number = format_value(HAL_TYPE_FLOAT, hal_value{.real = event.value});
        if (const auto semicolon = what.find(';'); semicolon != std::string::npos) done = what.substr(semicolon), what.resize(semicolon);
        if (const auto braces = what.find("{}"); braces != std::string::npos) what.replace(braces, 2, number);
        else if (const auto code = what.find("{x}"); code != std::string::npos) what.replace(code, 3, hexadecimal(event.value));
        else if (!std::isnan(event.value)) what += " (" + number + ")";
        return {"component", (instance ? instance->name + ": " : thread.name + ": ") + what + at + done +
                                 (instance ? "; see: show pin " + instance->name : "")};
    }
    case HAL_FAULT_NONE: break;
    }
    return {"component", thread.name + ": a fault" + at};
}

std::string worded(const Way& way) {
    const std::string& pin = way.pin->name;
    std::string line = way.pin->signal->name + ": " + (way.pin->dir == HAL_DIR_OUT ? way.far + " => " + pin : pin + " => " + way.far);
    line += "  " + std::to_string(way.cycles) + (way.cycles == 1 ? " cycle" : " cycles") + " on the wire, " +
            format_duration(static_cast<double>(way.worst_ns)) + " at worst";
    if (way.round_trip != 0) line += "; there and back " + std::to_string(way.round_trip) + (way.round_trip == 1 ? " cycle" : " cycles");
    return line;
}

}  // namespace

void Session::State::collect_faults() {
    for (const auto& thread : model.threads) collect_faults(*thread);
}

void Session::State::collect_faults(const Thread& thread) {
    Core* const from = core(&thread);
    if (!from) return;
    collect_stalls();
    for (FaultEvent event; from->next_fault(event);) {
        const auto again = std::find_if(fault_log.rbegin(), fault_log.rend(), [&](const LoggedFault& f) {
            return event.repeats != 0 && f.event.code != HAL_FAULT_NONE && f.event.repeats != 0 && f.record.thread == thread.name &&
                   f.event.same(event) && event.time_ns - f.event.last_ns < same_row_ns;
        });
        if (again != fault_log.rend()) {
            again->record.count += event.repeats;
            again->record.span_ns = event.last_ns - again->record.age_ns;
            again->event = event;
            continue;
        }
        const bool silent = event.code == HAL_FAULT_SILENT_THREAD && event.subject == 0;
        auto [code, sentence] = worded(
            model, thread, event,
            silent ? executor->supervisor().process_gap_ns(event.time_ns, static_cast<std::int64_t>(event.value)) : 0);  // else it may be NaN
        FaultRecord record;
        record.number = ++fault_number;
        record.cycle = event.cycle;
        record.thread = thread.name;
        record.code = code.name();
        record.sentence = std::move(sentence);
        record.age_ns = event.time_ns;  // made an age when it is asked for
        if (event.repeats != 0) record.count = event.repeats, record.span_ns = event.last_ns - event.time_ns;
        fault_log.push_back({std::move(record), event});
        if (fault_log.size() > kept_faults) fault_log.pop_front();
    }
}

namespace {

/// What kept the thread from ending its cycle, beginning with its name.
std::string worded(const Session::State& s, const Thread& thread, const Stall& stall) {
    const auto name_of = [&](std::uint32_t id) -> std::string {
        for (const auto& [one, core] : s.cores)
            if (core->id() == id) return "'" + one->name + "'";
        return "a thread that is gone";
    };
    const std::string silent = format_duration(static_cast<double>(stall.silent_ns));
    const LoadedFunction* const function = stall.function != 0 ? function_with_id(s.model, stall.function) : nullptr;
    std::string text = thread.name + ": ";
    using enum Stall::Cause;
    switch (stall.cause) {
    case process:
        text += "the process got no CPU time for " + silent + " (stopped by a signal or a debugger, or the host was busy)";
        break;
    case suspended: text += "the host was suspended for " + silent; break;
    case busy:
    case waiting:
    case stopped:
    case starved:
        text += (function ? function_text(*function) + " has not returned, no cycle ended for " : "no cycle ended for ") + silent;
        text += stall.cause == busy      ? ", it uses CPU time (a long computation or an endless loop)"
                : stall.cause == waiting ? ", it waits in a system call"
                : stall.cause == stopped ? stall.tracer != 0 ? ", stopped by the debugger with process ID " + std::to_string(stall.tracer)
                                                             : std::string(", stopped by a signal")
                                         : ", it gets no CPU time";
        if (stall.occupant != 0) text += ": thread " + name_of(stall.occupant) + " uses CPU " + std::to_string(stall.cpu);
        break;
    }
    text += limit_of(thread) + " at cycle " + grouped(stall.cycle);
    text += "; the thread's functions are stopped and its outputs were set to their safe values";
    if (stall.starved_count != 0) {
        text += stall.starved_count == 1 ? "; thread " : "; threads ";
        for (std::uint32_t i = 0; i < stall.starved_count; ++i) text += (i == 0 ? "" : ", ") + name_of(stall.starved[i]);
        text += std::string(" got no CPU time beside it") +
                (stall.demoted ? " until its real-time priority was taken away" : ", nor get any now: its priority could not be taken away");
    } else if (stall.demoted) {
        text += "; its real-time priority was taken away";
    }
    return text + "; see: show thread " + thread.name;
}

}  // namespace

void Session::State::collect_stalls() {
    for (Stall stall; executor->supervisor().next(stall);) {
        const auto of = std::find_if(cores.begin(), cores.end(), [&](const auto& one) { return one.second->id() == stall.thread; });
        if (of == cores.end()) continue;  // the thread has gone since
        LoggedFault logged;
        logged.record.number = ++fault_number;
        logged.record.age_ns = stall.time_ns;
        logged.record.cycle = stall.cycle;
        logged.record.thread = of->first->name;
        logged.record.code = FaultCode("hung-thread").name();
        logged.record.sentence = worded(*this, *of->first, stall);
        fault_log.push_back(std::move(logged));
        if (fault_log.size() > kept_faults) fault_log.pop_front();
    }
}

void Session::State::hung_thread(const Thread& thread, const Core& core, Diagnostics& diagnostics) const {
    const std::uint32_t id = core.hung_function();
    const LoadedFunction* const function = id != 0 ? function_with_id(model, id) : nullptr;
    const std::string silent = format_duration(static_cast<double>(monotonic_ns() - core.finished_ns()));
    diagnostics.error("hung-thread", thread.made,
                      "thread '" + thread.name + "' has not finished a cycle for " + silent +
                          (function ? ": " + function_text(*function) + " does not return" : ""),
                      "its outputs are at their safe values", "show fault says more; a function that never returns ends only with the process");
}

std::vector<FaultRecord> Session::faults() const {
    state_->collect_faults();
    std::vector<FaultRecord> records;
    const std::int64_t now = now_ns();
    for (const State::LoggedFault& logged : state_->fault_log) {
        records.push_back(logged.record);
        records.back().age_ns = now - logged.record.age_ns;
    }
    return records;
}

std::string FaultRecord::line() const {
    if (count == 1) return sentence;
    char text[80];
    std::snprintf(text, sizeof text, " (%llu times in %.1f s)", static_cast<unsigned long long>(count),
                  std::max(static_cast<double>(span_ns) * 1e-9, 0.1));
    return sentence + text;
}

std::uint64_t Session::fault_count() const {
    const hal_faults& shared = state_->executor->board().shared;
    return __atomic_load_n(&shared.count, __ATOMIC_ACQUIRE) - __atomic_load_n(&shared.cleared, __ATOMIC_ACQUIRE);
}

void Session::clear_faults() {
    state_->collect_faults();
    state_->fault_log.clear();
    state_->executor->board().clear();
}

ThreadReport Session::thread_report(const Thread& thread) const {
    const State& s = *state_;
    ThreadReport report;
    report.name = thread.name;
    report.period_ns = thread.options.period_ns;
    const Core* const core = s.core(&thread);
    if (!core) return report;
    report.cycles = core->cycles.load();
    report.missed = core->missed_by(monotonic_ns());
    report.overruns = core->overruns.load();
    report.wakeup_p50_ns = core->wakeup.quantile(0.5);
    report.wakeup_p99_ns = core->wakeup.quantile(0.99);
    report.wakeup_max_ns = static_cast<double>(core->wakeup.max_ns());
    report.busy_p50_ns = core->busy.quantile(0.5);
    report.busy_p99_ns = core->busy.quantile(0.99);
    report.busy_max_ns = static_cast<double>(core->busy.max_ns());
    const Granted granted = s.executor->granted(*core);
    report.policy = policy_text(granted, s.executor->is_virtual());
    report.cpu = granted.cpu;
    report.page_faults = s.executor->page_faults(*core);
    report.faulted = core->stopped_by_fault();
    report.supervised = thread.options.supervision_limit_ns() != 0;
    report.hangs = core->hangs.load();
    report.hung = core->hung();
    if (report.hung) {
        report.silent_ns = monotonic_ns() - core->finished_ns();
        const std::uint32_t id = core->hung_function();
        if (const LoadedFunction* const function = id != 0 ? function_with_id(s.model, id) : nullptr) report.function = function->name;
    }
    if (s.executor->supervisor().demoted(*core)) report.policy = "SCHED_OTHER (hung: no real-time priority until start)";
    return report;
}

std::vector<ThreadReport> Session::thread_reports() const {
    std::vector<ThreadReport> reports;
    for (const auto& thread : model().threads) reports.push_back(thread_report(*thread));
    return reports;
}

std::optional<ClockReport> Session::clock_report() const {
    const Instance* const leader = clock_leader(model());
    if (!leader) return {};
    const Timeline& timeline = state_->executor->timeline();
    return ClockReport{leader->name, timeline.shift_ns(), timeline.rate()};
}

std::vector<std::string> Session::missing_privileges() const {
    const State& s = *state_;
    std::vector<std::string> missing;
    bool scheduling = false;
    for (const auto& [thread, core] : s.cores) scheduling = scheduling || s.executor->granted(*core).refused;
    const std::string grant = "; grant it with: " + grant_command() + " (or by limits of a group: hal doctor)";
    if (scheduling) missing.push_back("no real-time scheduling here: threads run as ordinary ones and are late under load" + grant);
    if (!s.cores.empty() && !s.options.virtual_clock && !s.executor->supervisor().has_own_cpu())
        missing.push_back("the threads use every CPU: their supervisor interrupts them every " +
                          format_duration(static_cast<double>(s.executor->supervisor().interval_ns())) + " for some microseconds");
    for (const std::string& one : s.refused)
        missing.push_back("no " + one + " here: a page fault can delay a cycle" + (scheduling ? "; the same command grants it" : grant));
    return missing;
}

void Session::note_latencies(std::vector<std::string> lines) { state_->latencies = std::move(lines); }

std::vector<std::string> Session::latency_lines() const {
    std::vector<std::string> lines = state_->latencies;
    for (const Delay& delay : delays(model())) {
        std::string line = delay.signal->name + ": ";
        const std::string reader = delay.reader->name;
        const auto thread_name = [](const Pin& pin) { const Thread* t = thread_of(pin); return t ? t->name : std::string("no thread"); };
        switch (delay.kind) {
        case Delay::Kind::same_cycle:
            line += delay.writer->name + " => " + reader + "  0 cycles (" + thread_name(*delay.reader) + ", writer runs first)";
            break;
        case Delay::Kind::next_cycle:
            line += delay.writer->name + " => " + reader + "  1 cycle (" + thread_name(*delay.reader) + ", reader runs first)";
            break;
        case Delay::Kind::other_thread:
            line += delay.writer->name + " => " + reader + "  the last finished cycle of " + thread_name(*delay.writer) + ", read in " +
                    thread_name(*delay.reader);
            break;
        case Delay::Kind::session: line += "=> " + reader + "  no writer: as set by sets"; break;
        case Delay::Kind::cell: line += "<=> " + reader + "  I/O pins: at once within a thread"; break;
        case Delay::Kind::unscheduled:
            line += delay.writer->name + " => " + reader + "  never: " + (thread_of(*delay.writer) ? "the reader" : "the writer") +
                    " is in no thread";
            break;
        }
        lines.push_back(std::move(line));
    }
    for (const auto& component : model().components)
        for (const auto& instance : component->instances)
            for (const Way& way : instance->ways)
                if (way.pin->signal) lines.push_back(worded(way));
    std::sort(lines.begin(), lines.end());
    return lines;
}

}  // namespace hal
