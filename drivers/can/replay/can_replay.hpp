// SPDX-License-Identifier: MIT
#pragma once

#include "link/can.hpp"

namespace hal::can::replay {

/// Opens `replay:FILE`: the frames of a capture at their times, starting at the first receive().
/// Frames sent are discarded. [setup]
Opened open(const std::string& file, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& file);

}  // namespace hal::can::replay
