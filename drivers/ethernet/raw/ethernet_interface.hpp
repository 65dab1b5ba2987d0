// SPDX-License-Identifier: MIT
// The properties of a network interface.
#pragma once

#include <string>

#include "link/ethernet.hpp"

namespace hal::ethernet::rawether {

struct Interface {
    int index = 0;         ///< 0: no such interface
    bool ethernet = false; ///< its frames have an Ethernet header
    bool up = false;       ///< set up, and with a carrier
    std::uint32_t mtu = 0;
    std::uint32_t speed = 0;
    Address address{};
};

/// Queries the kernel, in the network namespace of this thread. [setup]
Interface ask(const std::string& name);
/// Returns the names of all interfaces: "eth0, lo". [setup]
std::string interfaces();

}  // namespace hal::ethernet::rawether
