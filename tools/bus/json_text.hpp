// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>

namespace hal::tools {

/// Returns a JSON string with its quotation marks. Bytes that are not UTF-8 are replaced. [setup]
std::string json_text(std::string_view text);

}  // namespace hal::tools
