// SPDX-License-Identifier: MIT
// The arguments of `newthread` and `loadrt threads`.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/model.hpp"
#include "netlist/netlist.hpp"
#include "text/diagnostic.hpp"

namespace hal {

struct NewThread {
    std::string name;
    Span at;          ///< of the name
    Span period_at, supervise_at;
    ThreadOptions options;
    bool omitted = false;  ///< period1=0: `loadrt threads` does not create it
};

/// `NAME PERIOD_NS [fp|nofp] [cpu=N] [policy=…] [priority=N] [spin=TIME] [budget=TIME] [supervise=TIME|off] [profile=every]`
bool parse_new_thread(std::span<const Token> args, NewThread& thread, Diagnostics& diagnostics);
/// `name1=… period1=… fp1=… cpu1=… name2=…`: as many as are named, without those of period 0.
/// LinuxCNC's defaults: thread1, 1 ms.
bool parse_threads(std::span<const Token> args, Span at, std::vector<NewThread>& threads,
                   Diagnostics& diagnostics);
/// LinuxCNC rounds a period to a multiple of the fastest thread's; so do we, with a warning.
void fit_period(const Model& model, NewThread& thread, Diagnostics& diagnostics);

}  // namespace hal
