// SPDX-License-Identifier: MIT
// What the session tells of the machine: threads, faults, delays, privileges.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "model/check/check.hpp"
#include "session/construct.hpp"
#include "session/state.hpp"

namespace hal {
namespace {

constexpr std::size_t kept_faults = 1000;

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
    std::string code, sentence;
};

Worded worded(const Model& model, const Thread& thread, const FaultEvent& event) {
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
    case HAL_FAULT_BUDGET:
        return {"budget", thread.name + ": the cycle took " + format_duration(event.value) + " (budget " +
                              format_duration(static_cast<double>(thread.options.budget_ns)) + ")" + at + "; see: show thread " +
                              thread.name};
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
    case HAL_FAULT_SILENT_THREAD:
    case HAL_FAULT_NONE: break;
    }
    return {"fault", thread.name + ": a fault" + at};
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
    for (FaultEvent event; from->next_fault(event);) {
        auto [code, sentence] = worded(model, thread, event);
        FaultRecord record;
        record.number = ++fault_number;
        record.cycle = event.cycle;
        record.thread = thread.name;
        record.code = std::move(code);
        record.sentence = std::move(sentence);
        record.age_ns = event.time_ns;  // made an age when it is asked for
        fault_log.push_back(std::move(record));
        if (fault_log.size() > kept_faults) fault_log.pop_front();
    }
}

std::vector<FaultRecord> Session::faults() const {
    state_->collect_faults();
    std::vector<FaultRecord> records(state_->fault_log.begin(), state_->fault_log.end());
    const std::int64_t now = now_ns();
    for (FaultRecord& record : records) record.age_ns = now - record.age_ns;
    return records;
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
    report.missed = core->missed.load();
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
    // PROGRAM is what the user started; setcap wants the file itself
    const std::string grant = "; grant it with: sudo setcap cap_sys_nice,cap_ipc_lock,cap_net_raw=ep $(readlink -f PROGRAM)";
    if (scheduling) missing.push_back("no real-time scheduling here: threads run as ordinary ones and are late under load" + grant);
    for (const std::string& one : s.refused)
        missing.push_back("no " + one + " here: a page fault can delay a cycle" + (scheduling ? "; the same setcap grants it" : grant) +
                          ", or 'memlock unlimited' in /etc/security/limits.conf");
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
