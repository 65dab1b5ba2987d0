// SPDX-License-Identifier: MIT
#pragma once

#include <string>

namespace hal::tools {

/// Replaces GCC's account of a failed `static_assert` of a header, how the templates led there and
/// what the assertion reads, by one line: the place in the user's file, and the sentence. Other
/// messages stay. [any]
std::string with_assertions_in_one_line(const std::string& messages);

}  // namespace hal::tools
