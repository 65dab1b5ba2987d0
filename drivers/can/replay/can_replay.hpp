// SPDX-License-Identifier: MIT
#pragma once

#include "link/can.hpp"

namespace hal::can::replay {

/// `replay:FILE`: the frames of a capture at their times, the first when it is first asked for one. What is sent goes nowhere. [setup]
Opened open(const std::string& file, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& file);

}  // namespace hal::can::replay
