// SPDX-License-Identifier: MIT
#pragma once

#include "link/can.hpp"

namespace hal::can::canudp {

/// `udp:GROUP:PORT`: frames as python-can's udp_multicast sends them. [setup]
Opened open(const std::string& place, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& place);

}  // namespace hal::can::canudp
