// SPDX-License-Identifier: MIT
// Writing JSON by appending to a string: for tables of a hundred thousand values. Reading is nlohmann's (control/connection.cpp).
#pragma once

#include <string>
#include <string_view>

#include "base/types.hpp"

namespace hal {

/// Appends the text as a JSON string. Bytes that are not UTF-8 are replaced by U+FFFD.
void json_quote(std::string& to, std::string_view text);
/// Appends a value: bits as true and false, numbers as numbers with all their digits, and "nan", "inf", "-inf" as strings
/// since JSON has no number for them. A port is the size of its buffer.
void json_value(std::string& to, hal_type type, const hal_value& value);

}  // namespace hal
