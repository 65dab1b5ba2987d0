// SPDX-License-Identifier: MIT
// The parts common to all command lines. The options of a command are in its own header, a struct
// that derives from one of these; `declare` sets their names and help.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace hal::tools {

class OptionSet;

struct Options {
    std::string program = "hal";         ///< how messages begin: "hal run", "halcmd"
    /// the positional arguments: files, a shell command, a component, a code
    std::vector<std::string> words;
    std::vector<std::string> arguments;  ///< behind `--`: $1 $2 … and NAME=VALUE of the netlists

    Options() = default;
    Options(const Options&) = default;
    Options& operator=(const Options&) = default;
    virtual ~Options() = default;
    /// Declares the options in the order of the help, each with the member that it fills.
    virtual void declare(OptionSet&) {}
};

enum class Loudness { nothing, errors, results };  ///< halcmd's -Q, -q (the default) and -v

/// Options of commands that execute lines of the command language, as set by halcmd's letters.
struct ExecutionOptions : Options {
    std::string name;  ///< --name: of the instance; empty: not given
    std::string ini;
    bool keep_going = false;
    bool script = false;
    bool echo = false;
    /// -f: the first word is a file of commands; without one, standard input
    bool from_file = false;
    bool classic = false;    ///< under the name halrun or halcmd: as LinuxCNC does it
    Loudness loudness = Loudness::errors;
};

}  // namespace hal::tools
