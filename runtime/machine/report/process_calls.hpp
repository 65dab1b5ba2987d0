// SPDX-License-Identifier: MIT
// Calls of components that concern the whole process: fork, close, the end of a thread or of the
// process. The program defines these functions of the C library, so that the calls of plugins and
// of libraries arrive here. Decisions 34 and 36.
#pragma once

namespace hal {

/// From now on a copy of the process that fork() makes loses what makes it a machine. [setup]
void contain_process_calls() noexcept;

}  // namespace hal
