// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "cli/option_set.hpp"

namespace hal::tools {

struct DocOptions : Options {
    bool markdown = false;
    bool json = false;
    bool man = false;
    bool html = false;
    bool all = false;
    std::string output;  ///< a folder

    void declare(OptionSet& set) override {
        set.words("COMPONENT", "a component's name, as in loadrt; without it: list all components",
                  false);
        set.flag("--markdown", markdown, "as Markdown");
        set.flag("--json", json, "as JSON");
        set.flag("--man", man, "as a troff page: hal doc pid --man | man -l -");
        set.flag("--html", html, "as a web page");
        set.flag("--all", all,
                 "all components, into the folder of --output: web pages with an index, or the "
                 "format chosen above");
        set.value("-o,--output", output, "DIR", "a folder; each component gets a file");
    }
};

/// Runs `hal doc`. Returns the exit code.
int run_doc(const DocOptions&);

}  // namespace hal::tools
