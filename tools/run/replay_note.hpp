// SPDX-License-Identifier: MIT
// Remarks of `hal replay --exact`.
#pragma once

#include <fmt/core.h>
#include <string>
#include <unistd.h>

#include "cli/output.hpp"
#include "run/replay.hpp"

namespace hal::tools {

/// Prints a remark on standard error.
inline void note(const ReplayOptions& options, const std::string& text) {
    write_all(STDERR_FILENO, fmt::format("{}: {}\n", options.program, text));
}

inline double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }

}  // namespace hal::tools
