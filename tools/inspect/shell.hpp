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
        set.value("-N,--name", name, "NAME", "of the instance to talk to; needed when several run");
        set.flag("-f,--file", from_file, "the first word is a file of commands; without one: standard input");
        set.values("-e,--execute", execute, "COMMAND", "execute this command; may be repeated");
        set.value("-i,--ini", ini, "FILE", "where [SECTION]KEY is looked up, with -f");
        set.flag("-k,--keep-going", keep_going, "go on after an error");
        set.flag("-s,--script", script, "output for scripts: no titles, one line per item");
        set.flag("--json", json, "output as JSON");
        set.flag("--echo", echo, "echo each command on stderr");
        set.flag("-q", [this] { loudness = Loudness::errors; }, "print errors only (the default)");
        set.flag("-Q", [this] { loudness = Loudness::nothing; }, "print nothing, not even errors");
        set.flag("-v", [this] { loudness = Loudness::results; }, "print the result of each command");
        set.keep_rest();
    }
};

/// `hal shell`, and halcmd. Returns the exit code.
int run_shell(const RemoteShellOptions&);

}  // namespace hal::tools
