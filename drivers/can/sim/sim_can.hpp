// SPDX-License-Identifier: MIT
#pragma once

#include "link/can.hpp"

namespace hal::can::simbus {

/// Opens `sim:NAME`: a node on the bus in memory of that name, which all links of one process
/// share. [setup]
Opened open(const std::string& name, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& name);

}  // namespace hal::can::simbus
