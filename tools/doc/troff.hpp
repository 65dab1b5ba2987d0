// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace hal::tools {

/// Returns a line of text as troff shows it unchanged: no request, no escape, hyphens that can be
/// copied. [any]
std::string troff(const std::string& line);

}  // namespace hal::tools
