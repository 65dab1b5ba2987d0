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
