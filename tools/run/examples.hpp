// SPDX-License-Identifier: MIT
#pragma once

#include <set>
#include <string>
#include <vector>

#include "cli/option_set.hpp"

namespace hal::tools {

/// A machine to start from: a netlist of the folder `halfiles` whose header states its topic.
struct Example {
    std::string name;     ///< what follows `hal examples`: furuta/hang
    std::string path;     ///< its netlist
    std::string topic;    ///< from its line `# Topic: …`
    std::string summary;  ///< the first sentence of its first comment
    std::set<std::string> missing;  ///< Debian packages of components that are not installed
};

/// All examples, ordered by topic and name; none when this program was copied without them.
/// [setup]
std::vector<Example> find_examples();

/// The examples by topic, a line each, with the packages that they need and that are missing; and
/// what installs these. [setup]
std::string list_of(const std::vector<Example>&);

/// Returns the name of the example that a path such as halfiles/furuta/hang.hal means where there is
/// no such file; "" for every other path. [setup]
std::string example_meant_by(const std::string& path);

struct ExamplesOptions : Options {
    void declare(OptionSet& set) override {
        set.keep_rest();  // options of `hal run`
    }
};

/// Runs `hal examples`. Returns the exit code, or becomes `hal run`.
int run_examples(const ExamplesOptions&);

}  // namespace hal::tools
