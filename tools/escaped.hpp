// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace hal::tools {

/// As it stands in XML and HTML: & < > " are entities.
std::string escaped(std::string_view text);

}  // namespace hal::tools
