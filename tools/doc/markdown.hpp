// SPDX-License-Identifier: MIT
// Converts Markdown with tables to HTML and troff, with libcmark-gfm where available.
#pragma once

#include <optional>
#include <string>

namespace hal::tools {

/// Returns nothing when this program was built without the library.
std::optional<std::string> markdown_as_html(const std::string& text);
std::optional<std::string> markdown_as_man(const std::string& text);

}  // namespace hal::tools
