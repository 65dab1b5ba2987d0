// SPDX-License-Identifier: MIT
// A session with its shell and its control socket: common to `hal run`, `hal sim` and `halrun`.
#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/prompt_loop.hpp"
#include "cli/signals.hpp"
#include "commands/shell.hpp"
#include "control/server.hpp"
#include "machine/report/cycle_guard.hpp"
#include "machine/report/descriptor_watch.hpp"
#include "machine/report/exit_observer.hpp"
#include "machine/report/setup_guard.hpp"
#include "machine/session.hpp"
#include "run/netlist_options.hpp"

namespace hal::tools {

/// How a journal takes part in an execution; what these point to outlives the machine.
struct Execution {
    ExecutionSink* sink = nullptr;  ///< gets the journal
    CycleSchedule* schedule = nullptr;  ///< has the cycles to be executed again
    /// The process is copied by fork(), which copies the calling thread and locks that others hold:
    /// the machine starts no thread. It handles no signal, and nobody watches its calls, cycles and
    /// descriptors.
    bool is_copied = false;
};

class HostedMachine {
public:
    /// Handles the signals that end a run. Programs started from its netlists find it through
    /// $HALCYON_INSTANCE.
    HostedMachine(const NetlistOptions& options, const std::string& name, bool virtual_clock,
                  Execution execution = {});
    ~HostedMachine();  ///< outputs safe, processes ended, instances destroyed
    HostedMachine(const HostedMachine&) = delete;

    /// Opens the control socket. Returns false after printing the error; a socket that is not
    /// `needed` is optional.
    bool serve(bool needed);
    /// Runs the files; their output goes to `output`, by default to the process's own. Returns the
    /// exit status.
    int load(Output* output = nullptr);
    /// Runs a netlist in Tcl; an empty path: lines from standard input. Returns 0, or 1 after
    /// printing why it failed.
    int run_script(const std::string& path, const std::vector<std::string>& arguments, Pass pass);
    /// Executes `start`, unless the threads are running.
    void start_threads();
    /// Opens the interactive shell until quit or the end. Returns the exit status.
    int converse(const Prompt& prompt);
    /// Advances the virtual clock; returns early when the end is requested.
    void advance(std::int64_t ns, std::uint64_t cycles);
    /// From now on a request to end the run stops the threads at once and interrupts what clients
    /// do, before the caller shuts down.
    void stop_at_once() { stops_at_once_ = true; }
    /// Ends the run: sets outputs to their safe values.
    void shut_down();
    /// Ends the run. Returns a line for each component that raised a fault while it stopped or was
    /// unloaded: what it drives may not have stopped.
    std::string end_report();
    /// Returns true when a fault has stopped a thread, or a thread has hung.
    bool faulted();

private:
    /// Returns true when the machine ends and none of its programs runs.
    bool programs_have_ended();

    // before the first thread of the process, and after the session
    std::unique_ptr<ExitObserver> observer_;

public:
    StopRequest stop;
    Session session;
    Shell shell;
    std::string ini_path;  ///< absolute: $EMC_INIFILE of scripts; set by load() and `hal linuxcnc`

private:
    void begin_watching(bool virtual_clock);
    void end_now();

    const NetlistOptions& options_;
    std::atomic<bool> stops_at_once_{false};
    ProcessOutput output_;
    std::unique_ptr<Server> server_;
    CycleGuard cycle_guard_;
    std::optional<SetupGuard> setup_guard_;
    std::uint64_t halt_ticket_ = 0;  // of descriptor_watch_
    std::optional<DescriptorWatch> descriptor_watch_;
};

/// For netlists and the programs they start: $1 $2 … and NAME=VALUE from behind `--`,
/// $HALCYON_INSTANCE, PATH.
void export_variables(const Options& options, const std::string& instance);
ShellOptions shell_options(const NetlistOptions& options);

/// Returns the instance name: --name, else $HALCYON_INSTANCE, else "default".
std::string own_name(const NetlistOptions& options);

}  // namespace hal::tools
