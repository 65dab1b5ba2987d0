// SPDX-License-Identifier: MIT
#pragma once

#include "link/datagram.hpp"

namespace hal::datagram::sim {

Opened open(const std::string& target, const Options&);
Description describe(const std::string& target);
/// Registers the server of a name. [setup]
Attached attach(const std::string& target, Server& server);

}  // namespace hal::datagram::sim
