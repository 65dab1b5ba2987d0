// SPDX-License-Identifier: MIT
#pragma once

#include "link/datagram.hpp"

namespace hal::datagram::udp {

/// Opens a socket connected to `HOST` or `HOST:PORT`. [setup]
Opened open(const std::string& target, const Options&);
Description describe(const std::string& target);

}  // namespace hal::datagram::udp
