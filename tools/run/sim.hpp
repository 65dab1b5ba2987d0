// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "run/netlist_options.hpp"

namespace hal::tools {

struct SimOptions : NetlistOptions {
    std::int64_t for_ns = -1;          ///< -1: not given
    std::uint64_t cycles = 0;          ///< 0: not given
    std::vector<std::string> show;     ///< names and patterns, separated by commas
    std::vector<std::string> execute;  ///< commands
    bool report = false;
    bool quiet = false;  ///< no summary
    std::string record;  ///< file
    std::string profile;  ///< of that file
    std::vector<std::string> values;  ///< to be recorded: names and patterns, separated by commas

    void declare(OptionSet& set) override {
        set.words("FILE", "netlists (.hal), or an INI file with [HAL]HALFILE");
        set.for_how_long(for_ns, "advance the virtual clock by 10s, 250ms … after loading");
        set.value("--cycles", cycles, "N",
                  "advance by N cycles of the fastest thread after loading");
        set.duration(
            "--cycle-limit", cycle_limit_ns,
            "end with status 1 when one cycle, or the wait for a program, takes longer than "
            "this in wall time",
            1, "10s, 1min or 500ms");
        set.value("-N,--name", name, "NAME", "of the instance");
        declare_netlists(set);
        set.flag("--report", report, "print the timing report on stderr at the end");
        set.values("--show", show, "NAMES",
                   "print these pins, parameters and signals at the end; patterns like 'pid.*' "
                   "too; may be repeated");
        set.value("--record", record, "FILE",
                  "record the time that --for or --cycles advances to FILE.mcap or FILE.csv");
        set.value(
            "--profile", profile, "PROFILE",
            "with --record FILE.mcap; ros2: write ROS 2 messages only, for rosbags and ros2 bag");
        set.values("--values", values, "NAMES",
                   "with --record: only these pins, parameters and signals; patterns too; may be "
                   "repeated");
        set.flag("-q,--quiet", quiet,
                 "no summary (default: on stderr, when that is a terminal or the netlist printed "
                 "nothing)");
        set.value("--node", part, "NAME",
                  "simulate only this node of a netlist for several machines (default: all nodes)");
        set.values("-e,--execute", execute, "COMMAND",
                   "execute this command at the end; for several machines: 'NODE: COMMAND', 'all: "
                   "COMMAND' or 'all: advance 5s'; may be repeated");
    }
};

class HostedMachine;

/// What --record does, which is in the program hal-tools.
struct SimRecorder {
    /// states what speaks against the file, before anything is loaded; an exit status
    int (*check)(const SimOptions&);
    /// advances by --for or --cycles and records meanwhile; an exit status
    int (*advance)(const SimOptions&, HostedMachine&);
};

/// Runs `hal sim`, without --record. Returns the exit status.
int run_sim(const SimOptions& options);

/// Runs `hal sim`; nullptr: without --record. Returns the exit status.
int simulate(const SimOptions& options, const SimRecorder* recorder);

}  // namespace hal::tools
