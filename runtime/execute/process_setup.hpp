// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <vector>

namespace hal {

/// Locks the memory of the process, limits the stacks of threads made later to 1 MB, and keeps the CPU out of deep sleep states, once per
/// process. Returns what the system denied: "memory locking". [setup]
std::vector<std::string> prepare_process();

}  // namespace hal
