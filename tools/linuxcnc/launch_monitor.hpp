// SPDX-License-Identifier: MIT
// What ends a run against its will: a program that dies or hangs, a thread that a fault stops.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "cli/output.hpp"
#include "hal/message_log.hpp"
#include "linuxcnc/launch_programs.hpp"
#include "linuxcnc/task_watch.hpp"

namespace hal::tools {

/// Polled by the thread of Launch, every 20 ms. It ends nothing.
class LaunchMonitor {
public:
    /// What ends the machine: the sentence, and whether task still commands motion until the end.
    struct Failure {
        std::string sentence;
        bool task_works = true;
    };

    LaunchMonitor(const Configuration&, HostedMachine&, LaunchPrograms&);

    /// Adds a component whose program must not die.
    void add(std::string component, std::string program) {
        components_.emplace_back(std::move(component), std::move(program));
    }
    /// Returns what has failed; its sentence is empty when nothing has.
    Failure failure(bool look_at_threads);
    /// Reports the times without CPU that did not stop a thread.
    void report_gaps();

private:
    /// Returns the sentence about a death among the programs that the machine needs, or "".
    std::string death();
    std::string death_of(const std::string& component, const std::string& program);
    /// Returns the sentence about a program that a signal has stopped, or a task whose heartbeat is
    /// missing, or "".
    std::string hang(bool& of_task);
    /// Returns the sentence about a thread that a fault has stopped, or "".
    std::string stopped_thread();

    const Configuration& configuration_;
    HostedMachine& machine_;
    LaunchPrograms& programs_;
    std::vector<std::pair<std::string, std::string>> components_;  // with their programs
    /// when death() last looked for linuxcncsvr
    std::chrono::steady_clock::time_point server_checked_{};
    TaskWatch task_watch_;
    /// by component: looks in a row that found its program stopped
    std::map<std::string, int> stopped_looks_;
    std::map<std::string, std::uint64_t> gaps_;  // by thread: gaps that were reported
    MessageLog gap_log_{"hal linuxcnc",
                        [](const std::string& line) { write_all(STDERR_FILENO, line); }};
};

}  // namespace hal::tools
