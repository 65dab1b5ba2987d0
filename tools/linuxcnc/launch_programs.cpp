// SPDX-License-Identifier: MIT
#include "linuxcnc/launch_programs.hpp"

#include <chrono>
#include <csignal>
#include <fmt/format.h>
#include <unistd.h>

#include "cli/output.hpp"
#include "linuxcnc/leftovers.hpp"
#include "machine/processes/programs.hpp"

namespace hal::tools {

namespace {

using namespace std::chrono_literals;

constexpr std::int64_t end_timeout_ns = 5'000'000'000;  // from SIGTERM to SIGKILL
// from the end of a program's connection to its exit status
constexpr std::int64_t exit_status_timeout_ns = 200'000'000;

/// True while only the connection of a dead program is known to have ended, and its exit status,
/// which states why it died, is still to come.
bool exit_status_follows(Programs& programs, const Programs::Entry& entry) {
    const bool may_follow = monotonic_ns() - entry.death()->since_ns < exit_status_timeout_ns;
    return may_follow && programs.runs_as_child(entry.pid);
}

}  // namespace

pid_t LaunchPrograms::start(const std::string& key, const Words& words, bool terminal) {
    ProcessStart how;
    how.arguments = words;
    how.directory = configuration_.folder;
    how.keep_stdin = terminal;
    std::string problem;
    const auto lock = machine_.session.lock();
    const pid_t pid = machine_.session.programs().start(how, true, problem);
    if (pid == 0) {
        fail(options_, fmt::format("{}: '{}' cannot be started: {}", key, words[0], problem));
    }
    return pid;
}

std::optional<int> LaunchPrograms::ended(pid_t pid) {
    const auto lock = machine_.session.lock();
    const auto* const entry = machine_.session.programs().find(pid);
    if (entry && !entry->ended()) return std::nullopt;
    return entry ? entry->status : 0;
}

std::optional<int> LaunchPrograms::wait_for(pid_t pid, std::int64_t ns) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::nanoseconds(ns);
    for (;;) {
        if (const auto status = ended(pid)) {
            const auto lock = machine_.session.lock();
            machine_.session.programs().collect(pid);
            return status;
        }
        if ((ns >= 0 && std::chrono::steady_clock::now() >= until) || machine_.stop.requested()) {
            return std::nullopt;
        }
        machine_.stop.wait_ns(5'000'000);
    }
}

std::vector<pid_t> LaunchPrograms::servers() {
    std::vector<pid_t> all;
    const auto lock = machine_.session.lock();
    for (bool again = true; again && all.empty();) {
        again = false;
        for (const Child& child : children()) {
            if (child.name != "linuxcncsvr") continue;
            // then the machine reaps it
            const auto* const entry = machine_.session.programs().find(child.pid);
            if (entry ? !entry->ended() : !child.ended) {
                all.push_back(child.pid);
            }
            // its successor may be newer than the list of processes
            else if (!entry && reap(child.pid)) {
                again = true;
            }
        }
    }
    return all;
}

bool LaunchPrograms::runs(const std::string& component) {
    const auto lock = machine_.session.lock();
    const auto* const entry = machine_.session.programs().find(component);
    return entry && !entry->dead();
}

std::string Launch::death_of(const std::string& component, const std::string& program) {
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

std::string Launch::death() {
    for (const auto& [component, program] : components_) {
        if (std::string found = death_of(component, program); !found.empty()) return found;
    }
    const auto now = std::chrono::steady_clock::now();
    if (now - looked_ < 500ms) {
        return {};  // reading all of /proc is not for every 20 ms
    }
    looked_ = now;
    return servers().empty() ? "'linuxcncsvr' died" : "";
}

std::string Launch::hang(bool& of_task) {
    constexpr int most_looks = 50;  // of 20 ms: a second
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
        if (looks < most_looks) continue;
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

std::string Launch::stopped_thread() {
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

Launch::Failure Launch::failure(bool look_at_threads) {
    Failure found;
    if (found.sentence = death(); !found.sentence.empty()) {
        found.task_works = runs("inihal");
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

void Launch::report_gaps() {
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

bool Launch::line_typed() {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    char c = 0;
    while (::poll(&input, 1, 0) > 0) {
        if (::read(STDIN_FILENO, &c, 1) <= 0 || c == '\n') return true;
    }
    return false;
}

void Launch::stop_threads() {
    const auto lock = machine_.session.lock();
    Diagnostics diagnostics;
    if (!machine_.session.threads().stop(&diagnostics)) {
        write_all(STDERR_FILENO,
                  render(diagnostics, machine_.session.sources, colours(STDERR_FILENO)));
    }
}

/// SIGTERM, and SIGKILL when that has no effect in time.
void LaunchPrograms::end_program(Program& program) {
    if (program.pid == 0) return;
    const auto gone = [&] {
        if (!ended(program.pid)) return false;
        const auto lock = machine_.session.lock();
        machine_.session.programs().collect(program.pid);
        return true;
    };
    for (const int number : {SIGTERM, SIGKILL}) {
        if (gone()) break;
        ::kill(program.pid, number);
        ::kill(program.pid, SIGCONT);
        for (std::int64_t waited = 0; waited < end_timeout_ns && !gone(); waited += 5'000'000) {
            ::usleep(5000);
        }
    }
    program.pid = 0;
}

void LaunchPrograms::end_server() {
    for (const int number : {SIGTERM, SIGKILL}) {
        for (const pid_t pid : servers()) {
            ::kill(pid, number);
        }
        for (std::int64_t waited = 0; waited < end_timeout_ns && !servers().empty();
             waited += 5'000'000) {
            ::usleep(5000);
        }
    }
}

void LaunchPrograms::end_component(const std::string& name) {
    auto lock = machine_.session.lock();
    Programs& programs = machine_.session.programs();
    const auto* const entry = programs.find(name);
    if (!entry) return;
    const std::uint64_t number = entry->number;
    for (int attempt = 0; attempt < 2; ++attempt) {
        auto* there = programs.find_number(number);
        if (!there) return;
        if (attempt == 0) {
            programs.terminate(*there);
        } else if (there->running()) {
            ::kill(there->pid, SIGKILL);
        }
        const auto until =
            std::chrono::steady_clock::now() + std::chrono::nanoseconds(end_timeout_ns);
        while ((there = programs.find_number(number)) && there->running() &&
               std::chrono::steady_clock::now() < until) {
            programs.wait(lock, 50ms);
        }
    }
}

/// Programs that others have started, and that have outlived them: helpers of the display.
void LaunchPrograms::end_orphans() {
    const auto ours = [&](pid_t pid) {
        const auto lock = machine_.session.lock();
        return machine_.session.programs().find(pid) != nullptr;
    };
    for (const int number : {SIGTERM, SIGKILL}) {
        bool any = true;
        if (number == SIGTERM) {
            for (const Child& child : children()) {
                if (!ours(child.pid)) {
                    ::kill(child.pid, number);
                }
            }
        }
        for (int waited = 0; any && waited < (number == SIGTERM ? 200 : 100); ++waited) {
            any = false;
            for (const Child& child : children()) {
                if (ours(child.pid) || reap(child.pid)) continue;
                any = true;
                if (number == SIGKILL) {
                    ::kill(child.pid, number);
                }
            }
            if (any) {
                ::usleep(10'000);
            }
        }
        if (!any) return;
    }
}

void LaunchPrograms::wait_until_idle() {
    auto lock = machine_.session.lock();
    const auto until = std::chrono::steady_clock::now() + std::chrono::nanoseconds(end_timeout_ns);
    while (!machine_.session.programs().idle() && std::chrono::steady_clock::now() < until) {
        machine_.session.programs().wait(lock, 50ms);
    }
}

}  // namespace hal::tools
