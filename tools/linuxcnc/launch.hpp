// SPDX-License-Identifier: MIT
// One run of a configuration: starts everything in LinuxCNC's order, waits for the end, ends
// everything in the reverse order.
#pragma once

#include <string>
#include <vector>

#include "cli/output.hpp"
#include "linuxcnc/configuration.hpp"
#include "linuxcnc/launch_monitor.hpp"
#include "linuxcnc/launch_programs.hpp"
#include "linuxcnc/leftovers.hpp"
#include "run/hosted_machine.hpp"

namespace hal::tools {

class RunJournal;

/// For one thread.
class Launch {
public:
    /// `journal`: of the machine; nullptr: none.
    Launch(const LinuxcncOptions&, const Configuration&, HostedMachine&, MachineLock&,
           RunJournal* journal);
    /// Returns the exit status, after end().
    int run();

private:
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
    void end();

    /// prints it with -v; false when the end was requested
    bool step(const std::string& sentence);
    bool command(const Words& words, const std::string& source);
    bool start_task_and_netlists();  ///< in the order of the version
    /// Notes the end of the display. Returns true when it has ended.
    bool display_ended();
    void report(const LaunchMonitor::Failure&);
    bool line_typed();
    void stop_threads();
    void run_shutdown();

    const LinuxcncOptions& options_;
    const Configuration& configuration_;
    HostedMachine& machine_;
    MachineLock& lock_;
    RunJournal* const journal_;
    ProcessOutput output_;
    LaunchPrograms programs_;
    LaunchMonitor monitor_;
    LaunchPrograms::Program display_{};
    std::vector<LaunchPrograms::Program> applications_;
    int status_ = 1;
};

}  // namespace hal::tools
