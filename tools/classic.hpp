// SPDX-License-Identifier: MIT
// The programs with LinuxCNC's names, option letters and exit codes.
#pragma once

#include <string_view>

#include "part.hpp"

namespace hal::tools {

struct Classic {
    const char* name;
    Part part;
    int (*run)(int argc, char** argv);  ///< nullptr: in another program
};

/// Returns the row of a program name, or nullptr.
const Classic* find_classic(std::string_view program);

}  // namespace hal::tools
