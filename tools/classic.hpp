// SPDX-License-Identifier: MIT
// The programs LinuxCNC users know, with LinuxCNC's own option letters and exit codes.
#pragma once

#include <string_view>

namespace hal::tools {

struct Classic {
    const char* name;
    int (*run)(int argc, char** argv);
};

/// The row of a program name, or nullptr.
const Classic* find_classic(std::string_view program);

}  // namespace hal::tools
