// SPDX-License-Identifier: MIT
// The processes of a run: started, asked for, ended.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <sys/types.h>
#include <vector>

#include "linuxcnc/configuration.hpp"
#include "run/hosted_machine.hpp"

namespace hal::tools {

/// Programs of a configuration, with or without a component, and what these leave behind. For the
/// thread of Launch: every call takes the session's lock itself.
class LaunchPrograms {
public:
    struct Program {
        std::string name;
        pid_t pid = 0;
    };

    LaunchPrograms(const LinuxcncOptions& options, const Configuration& configuration,
                   HostedMachine& machine)
        : options_(options), configuration_(configuration), machine_(machine) {}

    /// Starts a program that is not a component. Returns 0 after printing why it failed.
    pid_t start(const std::string& key, const Words& words, bool terminal = false);
    /// Returns the exit status, or 128 + signal, of a program that was started by start(); nullopt
    /// while it runs.
    std::optional<int> ended(pid_t pid);
    /// The same after at most `ns` (negative: no limit), or until the end is requested.
    std::optional<int> wait_for(pid_t pid, std::int64_t ns);
    /// Returns the processes of linuxcncsvr. It makes itself a daemon, which this process adopts.
    std::vector<pid_t> servers();
    /// Returns true when the program of that component runs.
    bool runs(const std::string& component);

    void end_program(Program& program);
    void end_server();
    void end_component(const std::string& name);
    void end_orphans();
    /// Waits until the session has no program any more, 5 s at most.
    void wait_until_idle();

private:
    const LinuxcncOptions& options_;
    const Configuration& configuration_;
    HostedMachine& machine_;
};

}  // namespace hal::tools
