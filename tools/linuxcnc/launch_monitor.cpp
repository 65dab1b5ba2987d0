// SPDX-License-Identifier: MIT
#include "linuxcnc/launch_monitor.hpp"

#include <algorithm>
#include <fmt/format.h>
#include <unistd.h>

#include "hal/clock.hpp"
#include "linuxcnc/leftovers.hpp"
#include "machine/processes/programs.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

using namespace std::chrono_literals;

namespace {

// from the end of a program's connection to its exit status
constexpr std::int64_t exit_status_timeout_ns = 200'000'000;

/// True while only the connection of a dead program is known to have ended, and its exit status,
/// which states why it died, is still to come.
bool exit_status_follows(Programs& programs, const Programs::Entry& entry) {
    const bool may_follow = monotonic_ns() - entry.death()->since_ns < exit_status_timeout_ns;
    return may_follow && programs.runs_as_child(entry.pid);
}

}  // namespace

LaunchMonitor::LaunchMonitor(const Configuration& configuration, HostedMachine& machine,
                             LaunchPrograms& programs)
    : configuration_(configuration),
      machine_(machine),
      programs_(programs),
      task_watch_(configuration.nml, configuration.task_timeout_ns) {}

std::string LaunchMonitor::death_of(const std::string& component, const std::string& program) {
    const auto lock = machine_.session.lock();
    Programs& programs = machine_.session.programs();
    const auto* const entry = programs.find(component);
    if (entry && (!entry->dead() || exit_status_follows(programs, *entry))) {
        return {};
    }
    const std::string who = component == program
                                ? fmt::format("'{}'", program)
                                : fmt::format("'{}' (component {})", program, component);
    std::string when = entry ? entry->death()->report : "";  // "since 12:34:56 (SIGKILL)"
    if (when.starts_with("since ")) {
        when.replace(0, 5, "at");
    }
    return when.empty() ? who + " died" : who + " died " + when;
}

std::string LaunchMonitor::death() {
    for (const auto& [component, program] : components_) {
        if (std::string found = death_of(component, program); !found.empty()) return found;
    }
    const auto now = std::chrono::steady_clock::now();
    if (now - server_checked_ < 500ms) {
        return {};  // reading all of /proc is not for every 20 ms
    }
    server_checked_ = now;
    return programs_.servers().empty() ? "'linuxcncsvr' died" : "";
}

std::string LaunchMonitor::hang(bool& of_task) {
    constexpr int max_looks = 50;  // of 20 ms: a second
    for (const auto& [component, program] : components_) {
        pid_t pid = 0;
        {
            const auto lock = machine_.session.lock();
            const auto* const entry = machine_.session.programs().find(component);
            if (entry && !entry->dead()) {
                pid = entry->pid;
            }
        }
        int& looks = stopped_looks_[component];
        looks = pid != 0 && state_of(pid) == 'T' ? looks + 1 : 0;
        if (looks < max_looks) continue;
        of_task = component == "inihal";
        return fmt::format("'{}' (component {}, process {}) is stopped by a signal for 1 s",
                           program, component, pid);
    }
    const std::int64_t silent_ns = task_watch_.silent_ns();
    if (silent_ns == 0) {
        return {};
    }
    of_task = true;
    return fmt::format("'{}' has ended no cycle for {} ([HALCYON]TASK_TIMEOUT {})",
                       configuration_.task[0], format_duration(static_cast<double>(silent_ns)),
                       format_duration(static_cast<double>(configuration_.task_timeout_ns)));
}

std::string LaunchMonitor::stopped_thread() {
    const auto lock = machine_.session.lock();
    if (!machine_.session.threads().running()) {
        return {};
    }
    for (const ThreadReport& report : machine_.session.reports().threads()) {
        if (!report.faulted && !report.hung) continue;
        const std::vector<FaultRecord> faults = machine_.session.reports().faults();
        const auto newest =
            std::find_if(faults.rbegin(), faults.rend(),
                         [&](const FaultRecord& fault) { return fault.thread == report.name; });
        if (newest == faults.rend()) {
            return fmt::format("thread '{}' is stopped by a fault", report.name);
        }
        return newest->sentence.substr(0, newest->sentence.find("; "));
    }
    return {};
}

LaunchMonitor::Failure LaunchMonitor::failure(bool look_at_threads) {
    Failure found;
    if (found.sentence = death(); !found.sentence.empty()) {
        found.task_works = programs_.runs("inihal");
        return found;
    }
    bool of_task = false;
    if (found.sentence = hang(of_task); !found.sentence.empty()) {
        found.task_works = !of_task;
        return found;
    }
    if (look_at_threads) {
        found.sentence = stopped_thread();
    }
    found.task_works = found.sentence.empty();
    return found;
}

void LaunchMonitor::report_gaps() {
    const std::int64_t now_ns = monotonic_ns();
    std::vector<ThreadReport> reports;
    {
        const auto lock = machine_.session.lock();
        reports = machine_.session.reports().threads();
    }
    for (const ThreadReport& report : reports) {
        std::uint64_t& seen = gaps_[report.name];
        if (report.gaps == seen) continue;
        seen = report.gaps;
        gap_log_.print(report.name,
                       fmt::format("{}: no CPU time for {}; the machine goes on "
                                   "([HALCYON]MAX_CPU_GAP {}); see: hal doctor",
                                   report.name, format_duration(static_cast<double>(report.gap_ns)),
                                   format_duration(static_cast<double>(configuration_.max_gap_ns))),
                       now_ns);
    }
    gap_log_.flush(now_ns);
}

}  // namespace hal::tools
