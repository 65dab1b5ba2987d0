// SPDX-License-Identifier: MIT
// Joins files whose journals continue each other.
#pragma once

#include <string>
#include <vector>

namespace hal {

/// Writes the messages of the files to `to`, from the last file that begins with a state on. A file
/// that is being written is read up to its last chunk. Returns why not, and then leaves no
/// file behind; "" when it is written.
/// [setup] in memory of a few MiB
std::string join_journals(const std::vector<std::string>& paths, const std::string& to);

}  // namespace hal
