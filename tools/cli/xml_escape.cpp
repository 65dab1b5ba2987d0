// SPDX-License-Identifier: MIT
#include "cli/xml_escape.hpp"

namespace hal::tools {

std::string xml_escape(std::string_view text) {
    std::string result;
    for (const char c : text) {
        switch (c) {
        case '&': result += "&amp;"; break;
        case '<': result += "&lt;"; break;
        case '>': result += "&gt;"; break;
        case '"': result += "&quot;"; break;
        default: result += c;
        }
    }
    return result;
}

}  // namespace hal::tools
