// SPDX-License-Identifier: MIT
// One run of a configuration: starts everything in LinuxCNC's order, waits for the end, ends
// everything in the reverse order.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <unistd.h>

#include "cli/output.hpp"
#include "hal/message_log.hpp"
#include "linuxcnc/configuration.hpp"
#include "linuxcnc/leftovers.hpp"
#include "linuxcnc/task_watch.hpp"
#include "run/hosted_machine.hpp"

namespace hal::tools {

class Launch {
public:
    Launch(const LinuxcncOptions&, const Configuration&, HostedMachine&, MachineLock&);
    /// Returns the exit status, after end().
    int run();

private:
    struct Program {
        std::string name;
        pid_t pid = 0;
    };

    // The steps, in order. Each returns false after printing why it failed, or when the end was
    // requested.
    bool check();
    bool start_server();
    bool start_component(const char* key, const char* component, const Words& program,
                         bool reads_ini = true);
    bool load_module(const Words& module);
    bool load_netlists();
    bool start_threads();  ///< after the commands of [HAL]HALCMD
    /// 2.10: waits until task has given motion the limits of the INI file
    bool task_knows_motion();
    bool start_task();  ///< of 2.9, with the threads
    bool start_applications();
    bool start_display();
    /// Waits for the first of: the display ends, a program dies or hangs, a fault stops a thread,
    /// the end is requested. Sets status_.
    void watch();
    /// What ends the machine: the sentence, and whether task still commands motion until the end.
    struct Failure {
        std::string sentence;
        bool task_works = true;
    };
    Failure failure(bool look_at_threads);
    void report_gaps();  ///< the times without CPU that did not stop a thread
    void end();

    /// prints it with -v; false when the end was requested
    bool step(const std::string& sentence);
    bool command(const Words& words, const std::string& source);
    /// Starts a program that is not a component. Returns 0 after printing why it failed.
    pid_t start(const std::string& key, const Words& words, bool terminal = false);
    /// The exit status, or 128 + signal, of a program that was started by start(); none: it runs.
    std::optional<int> ended(pid_t pid);
    std::optional<int> wait_for(pid_t pid, std::int64_t ns);
    /// Returns the sentence about a death among the programs that the machine needs, or "".
    std::string death();
    std::string death_of(const std::string& component, const std::string& program);
    /// Returns the sentence about a program that a signal has stopped, or a task whose heartbeat is
    /// missing, or "".
    std::string hang(bool& of_task);
    /// Returns the sentence about a thread that a fault has stopped, or "".
    std::string stopped_thread();
    /// The processes of linuxcncsvr. It makes itself a daemon, which this process adopts.
    std::vector<pid_t> servers();
    /// Returns true when the program of that component runs.
    bool runs(const std::string& component);
    bool line_typed();
    void end_program(Program& program);
    void end_server();
    void end_component(const std::string& name);
    void end_orphans();
    void stop_threads();

    const LinuxcncOptions& options_;
    const Configuration& configuration_;
    HostedMachine& machine_;
    MachineLock& lock_;
    ProcessOutput output_;
    Program display_{};
    std::vector<Program> applications_;
    /// name and program of those that must not die
    std::vector<std::pair<std::string, std::string>> components_;
    int status_ = 1;
    std::chrono::steady_clock::time_point looked_{};  ///< when death() last looked for linuxcncsvr
    TaskWatch task_watch_;
    /// by component: looks in a row that found its program stopped
    std::map<std::string, int> stopped_looks_;
    std::map<std::string, std::uint64_t> gaps_;  ///< by thread: gaps that were reported
    MessageLog gap_log_{"hal linuxcnc",
                        [](const std::string& line) { write_all(STDERR_FILENO, line); }};
};

}  // namespace hal::tools
