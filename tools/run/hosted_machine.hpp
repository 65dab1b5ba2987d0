// SPDX-License-Identifier: MIT
// A session with its shell and its control socket: what `hal run`, `hal sim` and `halrun` have in common.
#pragma once

#include <memory>
#include <string>

#include "cli/prompt_loop.hpp"
#include "cli/signals.hpp"
#include "commands/shell.hpp"
#include "control/server.hpp"
#include "machine/cycle_guard.hpp"
#include "machine/session.hpp"
#include "machine/setup_call.hpp"
#include "run/netlist_options.hpp"

namespace hal::tools {

class HostedMachine {
public:
    /// Takes over the signals that ask for an end. Programs started from its netlists find it through $HALCYON_INSTANCE.
    HostedMachine(const NetlistOptions& options, const std::string& name, bool virtual_clock);
    ~HostedMachine();  ///< outputs safe, processes ended, instances destroyed
    HostedMachine(const HostedMachine&) = delete;

    /// Opens the control socket. Returns false after printing the error; a socket that is not `needed` is optional.
    bool serve(bool needed);
    /// Runs the files; what they print goes to `output`, without one to the process's own. Returns the exit status.
    int load(Output* output = nullptr);
    /// `start`, unless the threads run already.
    void start_threads();
    /// Lets the user type until quit or the end. Returns the exit status.
    int converse(const Prompt& prompt);
    /// Virtual clock: advances; ends early when the end was requested.
    void advance(std::int64_t ns, std::uint64_t cycles);
    /// Makes outputs safe: the end of the run.
    void shut_down();
    /// A fault has stopped one of the threads, or one of them hung at some time.
    bool faulted();

    StopRequest stop;
    Session session;
    Shell shell;

private:
    const NetlistOptions& options_;
    ProcessOutput output_;
    std::unique_ptr<Server> server_;
    CycleGuard cycle_guard_;
    SetupGuard setup_guard_;
};

/// For netlists and the programs they start: $1 $2 … and NAME=VALUE from behind `--`, $HALCYON_INSTANCE, PATH.
void export_variables(const Options& options, const std::string& instance);
ShellOptions shell_options(const NetlistOptions& options);

/// The instance `hal run` makes: --name, else $HALCYON_INSTANCE, else "default".
std::string own_name(const NetlistOptions& options);

}  // namespace hal::tools
