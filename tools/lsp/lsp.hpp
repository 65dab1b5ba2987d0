// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

#include "cli/option_set.hpp"

namespace hal::tools {

struct LspOptions : Options {
    std::string ini;
    std::vector<std::string> assume;  ///< components of the target machine only
    std::string name;    ///< of the instance; empty: not given
    bool stdio = false;  ///< accepted because clients add it; there is no other transport

    void declare(OptionSet& set) override {
        set.value("-i,--ini", ini, "FILE",
                  "INI file for [SECTION]KEY of netlists that no INI file names");
        set.values("--assume", assume, "NAME",
                   "a component, or a prefix of names, that exists on the target machine only");
        set.value("--name", name, "NAME", "instance whose live values are shown");
        set.flag("--stdio", stdio, "use standard input and output (the default)");
    }
};

/// Runs `hal lsp`: a language server on standard input and output. Returns the exit code.
int run_lsp(const LspOptions&);

}  // namespace hal::tools
