// SPDX-License-Identifier: MIT
#pragma once

#include "link/can.hpp"

namespace hal::can::canudp {

/// `udp:GROUP:PORT`: frames as python-can's udp_multicast sends them. [setup]
Opened open(const std::string& place, const Options&);

}  // namespace hal::can::canudp
