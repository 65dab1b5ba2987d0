// SPDX-License-Identifier: MIT
#pragma once

#include "link/can.hpp"

namespace hal::can::canudp {

/// Opens `udp:GROUP:PORT`: frames in the format of python-can's udp_multicast. [setup]
Opened open(const std::string& target, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& target);

}  // namespace hal::can::canudp
