// SPDX-License-Identifier: MIT
// The programs with LinuxCNC's names, option letters and exit codes.
#pragma once

#include <string_view>

namespace hal::tools {

struct Classic {
    const char* name;
    int (*run)(int argc, char** argv);
};

/// Returns the row of a program name, or nullptr.
const Classic* find_classic(std::string_view program);

}  // namespace hal::tools
