// SPDX-License-Identifier: MIT
// A session with its shell and its control socket: what `hal run`, `hal sim` and `halrun` have in common.
#pragma once

#include <memory>
#include <string>

#include "options.hpp"
#include "session/session.hpp"
#include "shell/server.hpp"
#include "shell/shell.hpp"
#include "signals.hpp"
#include "talk.hpp"

namespace hal::tools {

class Machine {
public:
    /// Takes over SIGINT and SIGTERM. Programs started from its netlists find it through $HALCYON_INSTANCE.
    Machine(const Options& options, const std::string& name, bool virtual_clock);
    ~Machine();  ///< outputs safe, processes ended, instances destroyed
    Machine(const Machine&) = delete;

    /// Opens the control socket. False after saying why on stderr; one that is not `needed` is done without.
    bool serve(bool needed);
    /// Runs the files. Returns the exit status.
    int load();
    /// `start`, unless the threads run already.
    void start_threads();
    /// Lets the user type until quit or the end. Returns the exit status.
    int talk(const Prompt& prompt);
    /// Virtual clock: advances; ends early when the end was requested.
    void advance(std::int64_t ns, std::uint64_t cycles);
    /// Makes outputs safe: the end of the run.
    void shut_down();
    /// A fault has stopped one of the threads.
    bool faulted();

    StopRequest stop;
    Session session;
    Shell shell;

private:
    const Options& options_;
    ProcessOutput output_;
    std::unique_ptr<Server> server_;
};

/// For netlists and the programs they start: $1 $2 … and NAME=VALUE from behind `--`, $HALCYON_INSTANCE, PATH.
void export_variables(const Options& options, const std::string& instance);
ShellOptions shell_options(const Options& options);

/// The instance `hal run` makes: --name, else $HALCYON_INSTANCE, else "default".
std::string own_name(const Options& options);

}  // namespace hal::tools
