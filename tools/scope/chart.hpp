// SPDX-License-Identifier: MIT
// A record as a file: SVG for reports, CSV for other programs.
#pragma once

#include <string>
#include <vector>

#include "scope/samples.hpp"

namespace hal::tools {

/// Returns an SVG picture: a lane per channel, one time axis with the trigger at 0, and the
/// measurements. `title`: the trigger in words.
std::string chart_svg(const std::vector<Channel>& channels, const Record& record,
                      const std::string& title);

/// Returns a table: time_s relative to the trigger, a column per channel, a row per time at which
/// any channel has a sample. A channel that has none at that time has the value that holds then.
std::string chart_csv(const std::vector<Channel>& channels, const Record& record);

/// Returns a table of measurements for a terminal, a line per channel.
std::string measurement_table(const std::vector<Channel>& channels, const Record& record);

}  // namespace hal::tools
