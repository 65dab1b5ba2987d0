// SPDX-License-Identifier: MIT
#include "doc/troff.hpp"

namespace hal::tools {

std::string troff(const std::string& line) {
    std::string text = line.starts_with('.') || line.starts_with('\'') ? "\\&" : "";
    for (const char c : line) {
        if (c == '\\') {
            text += "\\e";
        } else if (c == '-') {
            text += "\\-";
        } else {
            text += c;
        }
    }
    return text;
}

}  // namespace hal::tools
