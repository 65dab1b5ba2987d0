// SPDX-License-Identifier: MIT
// Paths as an editor names them: file URIs (RFC 8089).
#pragma once

#include <string>
#include <string_view>

namespace hal::tools {

/// Returns the path of a `file:` URI without `.`, `..` and percent-encoding; another URI as it is
/// (the text of an editor without a file, such as `untitled:1`).
std::string path_of_uri(std::string_view uri);
/// Returns the URI of an absolute path; what is not a path as it is.
std::string uri_of_path(std::string_view path);

}  // namespace hal::tools
