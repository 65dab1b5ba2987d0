// SPDX-License-Identifier: MIT
// The file that a recorder grows: nobody else writes it meanwhile, and what an earlier recorder
// left is not lost. [setup]
#pragma once

#include <string>

namespace hal::mcap {

/// Returns what speaks against a recording of that name: a folder, a pipe or a device, a folder
/// that is missing or cannot be written; "" when nothing does. Creates and removes a file beside
/// it.
std::string unwritable(const std::string& path);

/// A file that is open for writing, empty and locked; or `problem`.
struct HeldFile {
    int file = -1;
    std::string path;  ///< what is open
    std::string target;  ///< what `path` is to become: the end of a symbolic link
    /// what the .part of an earlier recorder is called now; "" when there was none
    std::string kept;
    std::string problem;  ///< a reason, without the name of the file
    int error = 0;  ///< errno, or EBUSY
};

/// Opens PATH.part, or PATH itself. A PATH.part with content is what a recorder that was killed has
/// left: it is renamed to BASE-unfinished-001.ENDING.
HeldFile hold_part(const std::string& path);
HeldFile hold_file(const std::string& path);

}  // namespace hal::mcap
