// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "cli/option_set.hpp"

namespace hal::tools {

struct RemoteShellOptions : ExecutionOptions {
    std::vector<std::string> execute;  ///< -e COMMAND
    bool json = false;

    void declare(OptionSet& set) override {
        set.value("-N,--name", name, "NAME", "the instance; required when several are running");
        set.flag("-f,--file", from_file,
                 "read commands from the file given as the first word, or from standard input");
        set.values("-e,--execute", execute, "COMMAND", "execute this command; may be repeated");
        set.value("-i,--ini", ini, "FILE", "INI file for [SECTION]KEY, with -f");
        set.flag("-k,--keep-going", keep_going, "continue after an error");
        set.flag("-s,--script", script, "output for scripts: no titles, one line per item");
        set.flag("--json", json, "output as JSON");
        set.flag("--echo", echo, "echo each command on stderr");
        set.flag("-q", [this] { loudness = Loudness::errors; }, "print errors only (the default)");
        set.flag("-Q", [this] { loudness = Loudness::nothing; }, "print nothing, not even errors");
        set.flag("-v", [this] { loudness = Loudness::results; },
                 "print the result of each command");
        set.keep_rest();
    }
};

/// Runs `hal shell`, and halcmd. Returns the exit code.
int run_shell(const RemoteShellOptions&);

}  // namespace hal::tools
