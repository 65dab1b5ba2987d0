// SPDX-License-Identifier: MIT
#pragma once

#include "link/ethernet.hpp"

namespace hal::ethernet::rawether {

/// Opens `eth:INTERFACE`: raw frames on an interface of this machine. Needs CAP_NET_RAW. [setup]
Opened open(const std::string& interface, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& interface);

}  // namespace hal::ethernet::rawether
