// SPDX-License-Identifier: MIT
#pragma once

#include "link/ethernet.hpp"

namespace hal::ethernet::udp {

/// Opens `udp:HOST[:PORT]`: the payload of frames of the only Ethertype in Options::types, in UDP
/// datagrams. [setup]
Opened open(const std::string& target, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& target);

}  // namespace hal::ethernet::udp
