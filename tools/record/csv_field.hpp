// SPDX-License-Identifier: MIT
// A field of a CSV file (RFC 4180).
#pragma once

#include <string>

namespace hal::tools {

/// Returns the text in quotation marks if it needs them.
inline std::string csv_field(const std::string& text) {
    if (text.find_first_of(",\"\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) {
        quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    }
    return quoted + '"';
}

}  // namespace hal::tools
