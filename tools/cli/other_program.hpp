// SPDX-License-Identifier: MIT
// The other programs of the tool box: hal-tools, hal-bus and hal-panel are beside `hal`, and built
// when they are first used.
#pragma once

#include <cstdint>
#include <string>
#include <sys/types.h>
#include <vector>

namespace hal::tools {

/// Replaces this process with the program of that name beside it, with the same arguments and
/// capabilities; builds it first where build_on_demand() does that. Returns the exit status of the
/// failure, after printing the reason. [setup]
int become_program(const char* name, char** argv);

/// Runs `hal-tools` with these arguments, the first of which is the name of a command, and waits
/// for its end. Returns its exit status. [setup]
int run_tool(std::vector<std::string> arguments);

/// Whether a program is ended (SIGTERM) with the thread that has started it.
enum class Lifetime : std::uint8_t { own, of_this };

/// Starts a program beside this one with these arguments, the first of which is the name of a
/// command, and does not wait for it; builds it first where build_on_demand() does that. Returns its
/// process, or -1 after printing why it does not run. [setup]
pid_t start_program(const char* name, std::vector<std::string> arguments, Lifetime lifetime);

}  // namespace hal::tools
