// SPDX-License-Identifier: MIT
// Sentences about what a recording does not have.
#pragma once

#include <string>
#include <vector>

#include "recording/mcap/reader.hpp"
#include "recording/mcap/recording.hpp"

namespace hal::mcap {

/// Returns "header.frame_id (string), name (string[]) and 2 more".
std::string listed(const std::vector<std::string>& fields);
/// Returns "rows after 0.25 s are missing, of '/hal/servo' (x, y)": what a file does not have that
/// is not read to its end.
std::string missing_rows(const Recording& recording);
/// Returns "rows from 0.25 s to 0.5 s are missing, ...": those of the damaged chunks of a file that
/// has others. Times count from the first readable row.
std::string missing_rows(const Recording& recording, const std::vector<ChunkIndex>& damaged);

}  // namespace hal::mcap
