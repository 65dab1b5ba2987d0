// SPDX-License-Identifier: MIT
// A session under measurement, fed with netlist text.
#pragma once

#include <string>
#include <string_view>

#include "machine/session.hpp"

namespace hal::bench {

/// What a text cost, ms of wall time; `cpu` is the processor time of all three.
struct Applied {
    double parse = 0;
    double apply = 0;
    double commit = 0;
    double cpu = 0;
    double all() const { return parse + apply + commit; }
};

class Runtime {
public:
    explicit Runtime(bool virtual_clock = false);
    /// The text as one transaction of edits. Throws std::runtime_error with the first diagnostic
    /// when it is rejected.
    Applied apply(std::string text);

    Session session;
};

/// `newthread` with the CPU and priority all threads of the bench have.
std::string new_thread(std::string_view name, long period_ns, int cpu, std::string_view more = "");

}  // namespace hal::bench
