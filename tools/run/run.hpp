// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "run/journal_settings.hpp"
#include "run/netlist_options.hpp"

namespace hal {
class ExecutionSink;
}

namespace hal::tools {

struct RunOptions : NetlistOptions, JournalSettings {
    std::int64_t for_ns = -1;  ///< -1: not given
    std::string watchdog;      ///< a device of the Linux watchdog API
    std::string dds;  ///< arguments of the DDS participant: "interfaces=10.0.0.1 domain=3"
    bool interactive = false;
    bool no_picture = false;
    bool tcl = false;  ///< halrun -T: reads lines of Tcl after the files

    void declare(OptionSet& set) override {
        set.words("FILE", "netlists (.hal or .tcl), or an INI file with [HAL]HALFILE", false);
        set.flag("-I,--interactive", interactive,
                 "open the shell after loading; leaving it ends the run");
        set.for_how_long(for_ns, "stop after 10s, 250ms, 2min …; default: run until Ctrl-C");
        set.value("-N,--name", name, "NAME",
                  "name of this instance, when several run on one machine (default: default)");
        set.value(
            "--group", group, "GROUP",
            "let the members of this group control the instance, and run programs by it, too");
        declare_netlists(set);
        set.value("--watchdog", watchdog, "DEVICE",
                  "write to this device (/dev/watchdog) while every thread makes progress");
        declare_journal(set);
        set.flag("--no-picture", no_picture, "no live picture in the terminal");
        set.value("--node", part, "NAME",
                  "load the part of this node of a netlist for several machines");
        set.value(
            "--dds", dds, "SETTINGS",
            "DDS discovery: interfaces=ADDRESS domain=N peers=… (default: this machine only)");
    }
};

class HostedMachine;

/// The journal of a run, while it is written.
class RunJournal {
public:
    virtual ~RunJournal() = default;
    virtual ExecutionSink& sink() = 0;
    /// Adds the texts of the netlists, and reports from now on that the file cannot be written.
    virtual void begin(HostedMachine& machine) = 0;
    /// The netlists are loaded: begins to record values. Returns an exit status.
    virtual int begin_values(HostedMachine& machine) = 0;
    /// The machine is about to shut down: nothing of it is read any more.
    virtual void end_values() = 0;
    /// The machine has ended: completes the file. Returns an exit status.
    virtual int end() = 0;
};

/// Runs `hal run` without --journal, and halrun. Returns the exit code.
int run_run(const RunOptions&);

/// Runs `hal run`; nullptr: without --journal. Returns the exit code.
int run_machine(const RunOptions&, RunJournal* journal);

}  // namespace hal::tools
