// SPDX-License-Identifier: MIT
// Markdown, with tables, as HTML and as troff: by libcmark-gfm where there is one.
#pragma once

#include <optional>
#include <string>

namespace hal::tools {

/// Nothing when this program was built without the library.
std::optional<std::string> markdown_as_html(const std::string& text);
std::optional<std::string> markdown_as_man(const std::string& text);

}  // namespace hal::tools
