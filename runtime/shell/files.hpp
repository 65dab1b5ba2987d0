// SPDX-License-Identifier: MIT
// Text files that are read as commands, and paths as users write them.
#pragma once

#include <string>
#include <string_view>

namespace hal {

/// The whole file into `text`. False: `problem` says why ("No such file or directory", "is a directory" …).
bool read_text_file(const std::string& path, std::string& text, std::string& problem);
/// `~` and `~/…` become the home directory; a relative path is taken from `directory` unless that is empty.
std::string resolve_path(const std::string& path, const std::string& directory);
/// The one name of the file, whatever way leads to it; `path` itself when it does not exist.
std::string canonical_path(const std::string& path);
/// "a/b.hal" gives "a", "b.hal" gives "".
std::string folder_of(const std::string& path);

}  // namespace hal
