// SPDX-License-Identifier: MIT
// Text files that are read as commands, and paths as users write them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace hal {

/// The whole file into `text`. False: `problem` is the reason ("No such file or directory", "it is
/// a directory" …). With `descriptors`, /dev/fd/N and /dev/stdin may be pipes.
bool read_text_file(const std::string& path, std::string& text, std::string& problem,
                    bool descriptors = false);
/// Where a netlist is looked for, as LinuxCNC does it: in `directory`, then in the folders of
/// HALLIB_PATH and HALLIB_DIR and in the installed library; `LIB:NAME` in HALLIB_DIR and the
/// installed library only.
std::vector<std::string> netlist_places(const std::string& name, const std::string& directory);
/// Reads the first readable file and sets `path` to it. False: `problem` is the reason.
bool read_netlist(const std::string& name, const std::string& directory, std::string& path,
                  std::string& text, std::string& problem);
/// `~` and `~/…` become the home directory; a relative path is taken from `directory` unless that
/// is empty.
std::string resolve_path(const std::string& path, const std::string& directory);
/// The one name of the file, whatever way leads to it; `path` itself when it does not exist.
std::string canonical_path(const std::string& path);
/// The path from the root, without `.` and `..`. A link stays one: what an INI file names is beside
/// the link, as in LinuxCNC.
std::string absolute_path(const std::string& path);
/// "a/b.hal" gives "a", "b.hal" gives "".
std::string folder_of(const std::string& path);

}  // namespace hal
