// SPDX-License-Identifier: MIT
// `hal linuxcnc`: runs a LinuxCNC configuration as LinuxCNC's launcher does.
#pragma once

#include <string>

#include "run/journal_settings.hpp"
#include "run/netlist_options.hpp"

namespace hal::tools {

struct LinuxcncOptions : NetlistOptions, JournalSettings {
    std::string planner, homing;  ///< in place of [TRAJ]TPMOD and [EMCMOT]HOMEMOD
    std::string halfiles;         ///< a folder for netlists, searched first
    bool verbose = false;
    bool linuxcnc_modules = false;

    void declare(OptionSet& set) override {
        set.words("FILE.ini", "the configuration of a machine");
        set.value("-N,--name", name, "NAME", "name of the instance (default: default)");
        set.value("-t,--tpmod", planner, "MODULE",
                  "trajectory planner, with its parameters, in place of [TRAJ]TPMOD");
        set.value("-m,--homemod", homing, "MODULE",
                  "homing module, with its parameters, in place of [EMCMOT]HOMEMOD");
        set.flag("-l,--linuxcnc-modules", linuxcnc_modules,
                 "load LinuxCNC's modules in place of Halcyon's components, where it has them");
        set.value("-H,--halfiles", halfiles, "FOLDER", "search netlists in this folder first");
        declare_journal(set);
        set.flag("-k,--keep-going", keep_going,
                 "continue after an error in a netlist, command by command");
        set.flag("-v,--verbose", verbose, "print each step");
    }
};

/// Runs the configuration until its display ends. Returns the display's exit status, 1 when the
/// start fails or a program dies.
int run_linuxcnc(const LinuxcncOptions&);

}  // namespace hal::tools
