// SPDX-License-Identifier: MIT
// Netlists in Tcl: runs tclsh with the commands of the machine as Tcl procedures, and answers each
// call of them.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "commands/shell.hpp"
#include "netlist/netlist.hpp"

namespace hal::tools {

struct TclScript {
    std::string path;                        ///< empty: lines from standard input
    std::string directory = {};              ///< to run in; empty: this process's
    std::vector<std::string> arguments = {};
    std::string ini_path = {};               ///< what $EMC_INIFILE is; empty: no INI file
    /// its values are in arrays: $::SECTION(KEY), a list of all values of the key
    const Ini* ini = nullptr;
    Pass pass = Pass::both;                  ///< commands of the other pass have no effect
};

struct TclAnswer {
    int status = 0;
    std::string out, err;
};

/// Executes one command, given as words.
using TclCommand = std::function<TclAnswer(const std::vector<std::string>& words)>;

/// Runs the script to its end, or ends it when `stop_fd` (-1: none) becomes readable. A command
/// that fails is a Tcl error whose message is its `err`; the result of any other is its `out`.
/// Returns the exit status of tclsh, or -1 after setting `problem` when it cannot be started.
int run_tcl(const TclScript& script, const TclCommand& command, int stop_fd, std::string& problem);

/// The program `haltcl`.
int haltcl(int argc, char** argv);

}  // namespace hal::tools
