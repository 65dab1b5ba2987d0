// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

namespace hal::tools {

/// Reads what PyVCP files use of Python as option values: strings, numbers with + - * /, tuples and
/// lists (arrays), dicts (objects), True, False, None (null) and the constants of Tk (their name as
/// a string). Returns nothing for anything else; never evaluates code.
std::optional<nlohmann::json> python_literal(std::string_view text);

}  // namespace hal::tools
