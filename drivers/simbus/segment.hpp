// SPDX-License-Identifier: MIT
#pragma once

#include "link/ethernet.hpp"

namespace hal::ethernet::simbus {

/// `sim:NAME`: a station on the Ethernet segment of that name in this process; `sim:NAME/STATION`: the station of that name, shared by
/// all who open it. [setup]
Opened open(const std::string& place, const Options&);

}  // namespace hal::ethernet::simbus
