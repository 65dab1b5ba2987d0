// SPDX-License-Identifier: MIT
// `hal replay`: a recording drives the inputs of a netlist on the virtual clock, and the netlist's
// own values are compared with it; with --exact the cycles of a journal are executed again.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "run/netlist_options.hpp"

namespace hal::tools {

struct ReplayOptions : NetlistOptions {
    std::int64_t for_ns = -1;
    double tolerance = -1;
    std::string names = "*", thread;
    bool quiet = false;
    bool exact = false;
    bool anyway = false;
    bool shell = false;
    bool panel = false;
    std::uint16_t port = 8080;
    std::string as_test;  ///< a folder
    std::string cut;      ///< a file
    std::string record;   ///< a file
    std::vector<std::string> edits;  ///< setp NAME VALUE, sets NAME VALUE
    std::string netlist;             ///< a file
    std::string at;                  ///< a time or a cycle number
    std::string until;              ///< a time or a cycle number
    std::string break_condition;    ///< NAME > VALUE
    std::vector<std::string> show;  ///< names, separated by commas

    void declare(OptionSet& set) override {
        set.words("FILE NETLIST",
                  "a recording (.mcap or .csv), then netlists that have values of the same names; "
                  "with --exact a journal only");
        set.duration("--for", for_ns, "replay this much (default: all)", 1);
        set.value("--tolerance", tolerance, "X",
                  "end with status 1 when a value differs from the recording by more than X")
            .not_negative();
        set.value("--names", names, "NAMES",
                  "use only these values of the recording: patterns separated by commas; with "
                  "--record, record only these");
        set.value("--thread", thread, "THREAD",
                  "the thread that plays the recording (default: the one that was recorded, else "
                  "the fastest)");
        set.flag("-q,--quiet", quiet, "print only values that differ by more than the tolerance");
        set.flag("--exact", exact,
                 "execute the journal of hal run --journal again, cycle by cycle, and compare");
        set.value("--until", until, "CYCLE|TIME",
                  "with --exact: stop after this cycle of the fastest thread, or after the first "
                  "cycle at "
                  "this time or later");
        set.value("--break", break_condition, "CONDITION",
                  "with --exact: stop after the first cycle with 'NAME > VALUE' (< >= <= == !=)");
        set.values("--show", show, "NAMES",
                   "with --exact: print these pins, parameters and signals at the end; may be "
                   "repeated");
        set.flag("--shell", shell,
                 "with --exact: a shell on the machine at any of its cycles; goes to --until or "
                 "--break first, type help in it");
        set.flag("--panel", panel,
                 "with --exact: the web panel on the machine at any of its cycles, with a time "
                 "line; goes to --until or --break first");
        set.value("-p,--port", port, "PORT",
                  "with --panel: TCP port (default: 8080; 0: any free port)");
        set.value("-N,--name", name, "NAME",
                  "with --panel: name of the instance that other programs find (default: replay)");
        set.values("--edit", edits, "EDIT",
                   "with --exact: from --at on, execute with another value: 'setp NAME VALUE' or "
                   "'sets SIGNAL VALUE'; may be repeated");
        set.value("--netlist", netlist, "FILE",
                  "with --exact: from --at on, execute with the machine of this netlist");
        set.value("--at", at, "CYCLE|TIME",
                  "with --exact: the cycle of the fastest thread, or the time, of --edit and "
                  "--netlist");
        set.value("--as-test", as_test, "DIR",
                  "with --exact: write a test of the journal up to here, whose --show values are "
                  "expected; run it with: hal replay DIR");
        set.value("--record", record, "FILE",
                  "with --exact: write the values of all cycles after the machine was loaded to "
                  "this recording, .mcap or .csv");
        set.value(
            "--cut", cut, "FILE",
            "with --exact: write the rest of the journal to FILE, which begins with the state "
            "of the machine here");
        set.flag("--anyway", anyway,
                 "with --exact: also with another program or plugin, and when instances open "
                 "devices or sockets again");
        declare_netlists(set);
    }
};

int run_replay(const ReplayOptions& options);

}  // namespace hal::tools
