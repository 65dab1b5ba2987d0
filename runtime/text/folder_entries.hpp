// SPDX-License-Identifier: MIT
// The contents of a folder that changes while it is read.
#pragma once

#include <filesystem>
#include <system_error>
#include <vector>

namespace hal {

/// Returns the paths of what is in a folder; nothing if it cannot be read, and only a part if it
/// disappears meanwhile, as that of a process in /proc does. A loop over a directory_iterator throws
/// then.
inline std::vector<std::filesystem::path> folder_entries(const std::filesystem::path& folder) {
    std::vector<std::filesystem::path> paths;
    std::error_code problem;
    std::filesystem::directory_iterator entry(folder, problem);
    while (!problem && entry != std::filesystem::directory_iterator()) {
        paths.push_back(entry->path());
        entry.increment(problem);
    }
    return paths;
}

}  // namespace hal
