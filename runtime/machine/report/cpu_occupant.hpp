// SPDX-License-Identifier: MIT
// Names what uses a CPU in place of a thread that is starved.
#pragma once

#include <string>

namespace hal {

/// Returns "process 1234 (stress, SCHED_FIFO 99)": a real-time thread of another process that is
/// ready to run on the CPU; "" when no such thread exists. Reads all of /proc. [setup]
std::string cpu_occupant(int cpu);

/// What to do about a thread that gets no CPU time on `cpu`; -1: it is not bound to one. [setup]
std::string starvation_help(int cpu);

}  // namespace hal
