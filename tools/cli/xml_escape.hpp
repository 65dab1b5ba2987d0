// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace hal::tools {

/// Returns text for XML and HTML: & < > " are entities.
std::string xml_escape(std::string_view text);

}  // namespace hal::tools
