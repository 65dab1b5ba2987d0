// SPDX-License-Identifier: MIT
// What the kernel says of an interface.
#pragma once

#include <string>

#include "link/ethernet.hpp"

namespace hal::ethernet::rawether {

struct Interface {
    int index = 0;         ///< 0: there is none of that name
    bool ethernet = false; ///< its frames have the header of Ethernet
    bool up = false;       ///< set up, and with a carrier
    std::uint32_t mtu = 0, speed = 0;
    Address address{};
};

/// [setup] Of this thread's network namespace.
Interface ask(const std::string& name);
/// "eth0, lo": those there are. [setup]
std::string interfaces();

}  // namespace hal::ethernet::rawether
