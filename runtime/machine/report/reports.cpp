// SPDX-License-Identifier: MIT
#include "machine/report/reports.hpp"

#include <algorithm>
#include <cstring>

#include <unistd.h>

#include "execute/executor.hpp"
#include "hal/privilege.hpp"
#include "machine/load/construct.hpp"
#include "machine/report/fault_log.hpp"
#include "machine/report/machine_view.hpp"
#include "model/check/check.hpp"
#include "text/quoting.hpp"

namespace hal {
namespace {

std::string policy_text(const Granted& granted, bool virtual_clock) {
    if (virtual_clock) return "virtual clock";
    if (granted.policy == Granted::Policy::fifo) {
        return "SCHED_FIFO " + std::to_string(granted.priority);
    }
    if (granted.policy == Granted::Policy::deadline) return "SCHED_DEADLINE";
    return granted.refused ? "SCHED_OTHER (no privilege)" : "SCHED_OTHER";
}

std::string delay_text(const PathDelay& path) {
    const std::string& pin = path.pin->name;
    std::string line =
        path.pin->signal->name + ": " +
        (path.pin->dir == HAL_DIR_OUT ? path.far + " => " + pin : pin + " => " + path.far);
    line += "  " + counted(path.cycles, "cycle") + " on the wire, " +
            format_duration(static_cast<double>(path.worst_ns)) + " at worst";
    if (path.round_trip != 0) {
        line += "; there and back " + counted(path.round_trip, "cycle");
    }
    return line;
}

}  // namespace

std::vector<FaultRecord> Reports::faults() const {
    faults_.collect();
    return faults_.records(machine_.executor.now_ns());
}

std::uint64_t Reports::fault_count() const {
    const hal_faults& shared = machine_.executor.board().shared.faults;
    return __atomic_load_n(&shared.count, __ATOMIC_ACQUIRE) -
           __atomic_load_n(&shared.cleared, __ATOMIC_ACQUIRE);
}

std::uint64_t Reports::lasting_count() const {
    return __atomic_load_n(&machine_.executor.board().shared.lasting, __ATOMIC_ACQUIRE);
}

std::vector<FaultRecord> Reports::clear_faults() {
    faults_.collect();
    machine_.executor.board().clear();
    faults_.clear();
    return faults_.lasting(machine_.executor.now_ns());
}

std::vector<FaultRecord> Reports::lasting_faults() const {
    faults_.collect();
    return faults_.lasting(machine_.executor.now_ns());
}

std::string ThreadReport::figure(double ns) const {
    return measured == 0 ? "-" : format_duration(ns);
}

ThreadReport Reports::thread(const Thread& thread) const {
    ThreadReport report;
    report.name = thread.name;
    report.period_ns = thread.options.period_ns;
    const Core* const core = machine_.core(&thread);
    if (!core) return report;
    report.cycles = core->monitor.cycles();
    report.missed = core->monitor.missed_by(machine_.executor.now_ns());
    report.overruns = core->overruns.load();
    report.over_budget = core->over_budget.load();
    report.measured = core->busy.samples();
    report.wakeup_p50_ns = core->wakeup.quantile(0.5);
    report.wakeup_p99_ns = core->wakeup.quantile(0.99);
    report.wakeup_max_ns = static_cast<double>(core->wakeup.max_ns());
    report.busy_p50_ns = core->busy.quantile(0.5);
    report.busy_p99_ns = core->busy.quantile(0.99);
    report.busy_max_ns = static_cast<double>(core->busy.max_ns());
    const Granted granted = machine_.executor.granted(*core);
    report.policy = policy_text(granted, machine_.executor.is_virtual());
    report.cpu = granted.cpu;
    report.page_faults = machine_.executor.page_faults(*core);
    report.faulted = core->stopped_by_fault();
    report.supervised = thread.options.supervision_limit_ns() != 0;
    report.hangs = core->monitor.hangs();
    report.gaps = core->monitor.gaps.load(std::memory_order_acquire);
    report.gap_ns = core->monitor.newest_gap_ns.load(std::memory_order_relaxed);
    report.hung = core->monitor.hung();
    if (report.hung) {
        report.silent_ns = monotonic_ns() - core->monitor.finished_ns();
        const std::uint32_t id = core->hung_function();
        if (const LoadedFunction* const function =
                id != 0 ? function_with_id(machine_.model, id) : nullptr) {
            report.function = function->name;
        }
    }
    if (machine_.executor.supervisor().demoted(*core)) {
        report.policy = "SCHED_OTHER (hung: no real-time priority until start)";
    }
    return report;
}

ThreadHistograms Reports::histograms(const Thread& thread) const {
    ThreadHistograms histograms;
    const Core* const core = machine_.core(&thread);
    if (!core) return histograms;
    const auto copy = [](const Histogram& from, std::vector<std::uint64_t>& to) {
        for (std::size_t i = 0; i < Histogram::buckets; ++i) {
            if (const std::uint64_t count = from.count(i); count != 0) {
                to.insert(to.end(), {Histogram::edge(i), count});
            }
        }
    };
    copy(core->wakeup, histograms.wakeup);
    copy(core->busy, histograms.busy);
    return histograms;
}

std::vector<ThreadReport> Reports::threads() const {
    std::vector<ThreadReport> reports;
    for (const auto& thread : machine_.model.threads) {
        reports.push_back(this->thread(*thread));
    }
    return reports;
}

std::optional<ClockReport> Reports::clock() const {
    const Instance* const leader = clock_leader(machine_.model);
    if (!leader) {
        return {};
    }
    const Timeline& timeline = machine_.executor.timeline();
    std::optional<std::int64_t> idle_ns;
    if (const auto adjusted_ns = timeline.adjusted_ns()) {
        idle_ns = std::max<std::int64_t>(0, machine_.executor.now_ns() - *adjusted_ns);
    }
    return ClockReport{leader->name, idle_ns, timeline.shift_ns(), timeline.rate()};
}

std::vector<std::string> Reports::missing_privileges() const {
    std::vector<std::string> missing;
    std::string what, effect;
    for (const auto& [thread, core] : machine_.cores) {
        if (machine_.executor.granted(*core).refused) {
            what = "real-time scheduling";
            effect = "threads are late under load";
        }
    }
    for (const std::string& one : refused_) {
        append_item(what, one, " and ");
        append_item(effect, "a page fault can delay a cycle", ", and ");
    }
    if (!what.empty()) {
        missing.push_back("no " + what + " here: " + effect + "; grant it with: " +
                          grant_command() + " (or by limits of a group: hal doctor)");
    }
    if (!machine_.cores.empty() && !machine_.executor.is_virtual() &&
        !machine_.executor.supervisor().has_own_cpu()) {
        missing.push_back(
            "the threads use every CPU: their supervisor interrupts them every " +
            format_duration(static_cast<double>(machine_.executor.supervisor().interval_ns())) +
            " for some microseconds");
    }
    return missing;
}

std::vector<std::string> Reports::latencies() const {
    std::vector<std::string> lines;
    for (const Delay& delay : delays(machine_.model)) {
        std::string line = delay.signal->name + ": ";
        const std::string reader = delay.reader->name;
        const auto thread_name = [](const Pin& pin) {
            const Thread* t = thread_of(pin);
            return t ? t->name : std::string("no thread");
        };
        switch (delay.kind) {
        case Delay::Kind::same_cycle:
            line += delay.writer->name + " => " + reader + "  0 cycles (" +
                    thread_name(*delay.reader) + ", writer runs first)";
            break;
        case Delay::Kind::next_cycle:
            line += delay.writer->name + " => " + reader + "  1 cycle (" +
                    thread_name(*delay.reader) + ", reader runs first)";
            break;
        case Delay::Kind::other_thread:
            line += delay.writer->name + " => " + reader + "  the last finished cycle of " +
                    thread_name(*delay.writer) + ", read in " + thread_name(*delay.reader);
            break;
        case Delay::Kind::session: line += "=> " + reader + "  no writer: as set by sets"; break;
        case Delay::Kind::cell:
            line += "<=> " + reader + "  I/O pins: at once within a thread";
            break;
        case Delay::Kind::unscheduled:
            line += delay.writer->name + " => " + reader +
                    "  never: " + (thread_of(*delay.writer) ? "the reader" : "the writer") +
                    " is in no thread";
            break;
        }
        lines.push_back(std::move(line));
    }
    for (const auto& component : machine_.model.components) {
        for (const auto& instance : component->instances) {
            for (const PathDelay& path : instance->path_delays) {
                if (path.pin->signal) {
                    lines.push_back(delay_text(path));
                }
            }
        }
    }
    std::sort(lines.begin(), lines.end());
    return lines;
}

std::string Reports::status_text() const {
    char host[256] = "";
    ::gethostname(host, sizeof host - 1);
    std::string text = "instance " + instance_ + "\nhost " + host + "\npid " +
                       std::to_string(::getpid()) + "\nrunning " +
                       (machine_.executor.running() ? "1" : "0") + "\n";
    for (const ThreadReport& thread : threads()) {
        text += "thread " + thread.name + " " + std::to_string(thread.period_ns) + " " +
                std::to_string(thread.cycles) + " " + std::to_string(thread.missed) + " " +
                (thread.faulted ? "1" : "0") + "\n";
    }
    text += "faults " + std::to_string(fault_count()) + "\n";
    faults_.collect();
    if (!faults_.empty()) {
        text += "fault " + faults_.newest().line() + "\n";
    }
    return text;
}

}  // namespace hal
