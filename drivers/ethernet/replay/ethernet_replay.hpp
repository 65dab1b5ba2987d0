// SPDX-License-Identifier: MIT
#pragma once

#include "link/ethernet.hpp"

namespace hal::ethernet::replay {

/// Opens `replay:FILE`: the Ethernet frames of a capture at their times, starting at the first
/// receive(). Frames sent are discarded. [setup]
Opened open(const std::string& file, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& file);

}  // namespace hal::ethernet::replay
