// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hal::tools {

/// Runs a program (found in PATH, without a shell) that reads all of `input` and writes its result
/// to standard output, which goes to `output`. Returns an error message, or an empty string.
/// `package`: the Debian package of the program, for the message when it is missing.
std::string run_filter(const std::vector<const char*>& arguments, std::string_view input,
                       std::string& output, const char* package);

}  // namespace hal::tools
