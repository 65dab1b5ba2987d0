// SPDX-License-Identifier: MIT
#pragma once

#include "link/ethernet.hpp"

namespace hal::ethernet::simbus {

/// Opens `sim:NAME`: a station on the Ethernet segment of that name in this process;
/// `sim:NAME/STATION`: the station of that name, shared by all users that open it. [setup]
Opened open(const std::string& target, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& target);

}  // namespace hal::ethernet::simbus
