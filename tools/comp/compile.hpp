// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "cli/option_set.hpp"

namespace hal::tools {

struct CompileOptions : Options {
    std::string output;  ///< the folder; empty: the user's
    bool check_rt = false;     ///< also start() and what needs load arguments
    bool no_check_rt = false;
    bool keep = false;
    /// halcompile: further words for the compiler
    std::vector<std::string> compile_args, link_args;
    bool as_program = false;                           ///< halcompile --userspace
    bool classic = false;                              ///< as halcompile: nothing is announced

    void declare(OptionSet& set) override {
        set.words("FILE",
                  "components: .cpp (hal/component.hpp), .comp (LinuxCNC's component language) or "
                  ".c (LinuxCNC's hal.h)");
        set.value("-o,--output", output, "DIR",
                  "install here; default: ~/.local/share/halcyon/components");
        set.flag("--check-rt", check_rt,
                 "run 1000 cycles with random and extreme values and report violations of real "
                 "time; default for .cpp files without start() and load arguments");
        set.flag("--no-check-rt", no_check_rt, "install without that check");
        set.flag("--keep", keep,
                 "keep the C code generated from a .comp file in the current folder");
    }
};

/// `hal compile`. Returns the exit code.
int run_compile(const CompileOptions&);

/// Builds one file and installs it in options.output. Returns the exit code.
int compile_file(const CompileOptions& options, const std::string& path);

}  // namespace hal::tools
