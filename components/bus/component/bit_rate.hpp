// SPDX-License-Identifier: MIT
// The bit rate of a link, against that of the configuration.
#pragma once

#include <stdexcept>
#include <string>

#include "link/can.hpp"

namespace hal::bus {

/// Throws when a link runs at another bit rate than `wanted`; `key` and `section` are what
/// surrounds the value in the configuration. [setup]
inline void check_bit_rate(const can::Description& link, const std::string& address,
                           std::uint32_t wanted, const std::string& key,
                           const std::string& section = "") {
    if (link.bit_rate == 0 || link.bit_rate == wanted || link.bit_rate == can::unlimited) return;
    const std::string here = std::to_string(wanted);
    const std::string there = std::to_string(link.bit_rate);
    std::string change_link = "bitrate=" + here + " in the address";
    if (!link.interface.empty()) {
        const std::string set = "sudo ip link set " + link.interface;
        change_link = set + " down && " + set + " up type can bitrate " + here;
    }
    throw std::runtime_error(address + " runs at " + there + " bit/s, the configuration has " +
                             here + "; change one of them: " + key + there + section + ", or " +
                             change_link);
}

}  // namespace hal::bus
