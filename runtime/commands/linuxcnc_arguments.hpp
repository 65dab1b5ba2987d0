// SPDX-License-Identifier: MIT
// `hal check --linuxcnc`: the load arguments of LinuxCNC's own modules, and their floating point.
#pragma once

#include <map>
#include <string>

#include "model/model.hpp"
#include "netlist/netlist.hpp"
#include "text/diagnostic.hpp"

namespace hal {

/// Reports what LinuxCNC's loader or module rejects of a `loadrt`: unknown and missing arguments,
/// values out of range. Modules that are not in the table are not checked.
void check_linuxcnc_arguments(const Command& loadrt, Diagnostics& diagnostics);

/// Threads of `loadrt threads ... fp1=0` take no function that uses floating point (up to 2.9.8).
class LinuxcncFloatingPoint {
public:
    /// Notes the threads of a `loadrt threads` that are without it.
    void load(const Command& loadrt);
    /// Reports an `addf` of a function that uses it to such a thread.
    void add(const Command& addf, const Model& model, Diagnostics& diagnostics) const;

private:
    std::map<std::string, Span, std::less<>> without_;  ///< by the name of the thread: its fp=0
};

}  // namespace hal
