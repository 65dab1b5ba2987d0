// SPDX-License-Identifier: MIT
// Recordings as tables of text: a row per cycle, a column per value.
#pragma once

#include <string>

#include "recording/mcap/recording.hpp"

namespace hal::mcap {

/// Loads a .csv as `hal record` writes it: the times of the first column are seconds, an empty
/// field has the value of the row before. Columns with values in the same rows make a table.
/// Returns false and sets `problem`.
bool load_csv(const std::string& path, Recording& to, std::string& problem,
              const LoadOptions& options);

}  // namespace hal::mcap
