// SPDX-License-Identifier: MIT
// A component under a guard: does a function of it allocate, lock, block, print, overrun or crash?
#pragma once

#include <string>
#include <vector>

#include "cli/options.hpp"
#include "comp/build_plugin.hpp"

namespace hal::tools {

struct RealtimeReport {
    /// What the component does wrong, each "NAME: function 'F' calls malloc in a cycle (FILE:LINE)",
    /// without a place where the line is unknown.
    std::vector<std::string> violations;
    /// Why it could not be checked, a sentence with the component's name; empty: it was checked.
    std::string unchecked;
    /// "2 functions ran 1000 cycles each with random and extreme values"; empty when not checked.
    std::string summary;

    bool good() const { return violations.empty() && unchecked.empty(); }
};

/// Runs one instance a thousand cycles with random inputs and extreme parameters, in a process of
/// its own: constructor, start(), functions, stop(), destructor. The load arguments are those of
/// `options`.
RealtimeReport check_realtime(const Options& options, const BuiltPlugin& built,
                              const PluginSource& source);

}  // namespace hal::tools
