// SPDX-License-Identifier: MIT
// JSON documents are built and written by nlohmann-json. Only arrays of up to a hundred thousand
// values are appended value by value.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "base/types.hpp"

namespace hal {

/// Returns the document as text in one line, members in their order. Bytes that are not UTF-8 are
/// replaced by U+FFFD. [any]
std::string json_text(const nlohmann::ordered_json& document);
/// Returns a value as json_value() writes it. [any]
nlohmann::ordered_json to_json(hal_type type, const hal_value& value);
/// Appends the text as a JSON string. Bytes that are not UTF-8 are replaced by U+FFFD.
void json_quote(std::string& to, std::string_view text);
/// Appends a value: bits as true and false, numbers as numbers with all their digits, and "nan",
/// "inf", "-inf" as strings since JSON has no number for them. A port is the size of its buffer.
void json_value(std::string& to, hal_type type, const hal_value& value);

}  // namespace hal
