// SPDX-License-Identifier: MIT
#pragma once

namespace hal::tools {

/// LinuxCNC's program of that name.
int halcompile(int argc, char** argv);

}  // namespace hal::tools
