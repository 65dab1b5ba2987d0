// SPDX-License-Identifier: MIT
// A group of pins that LinuxCNC's lcec computes from objects of a slave: `din din-0 in=6000:01`.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

namespace hal::ethercat::config {

/// An object of the process data, or a part of it.
struct ChannelObject {
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    unsigned first_bit = 0;
    unsigned bits = 0;  ///< 0: all
};

/// The kind decides what the pins do; plugins/channels/ has a class for each.
struct Channel {
    std::string kind;
    std::string name;  ///< the beginning of the names of its pins
    std::map<std::string, ChannelObject, std::less<>> objects;  ///< by role
    std::map<std::string, double, std::less<>> settings;

    /// Returns nullptr for a role without an object.
    const ChannelObject* object(std::string_view role) const {
        const auto at = objects.find(role);
        return at == objects.end() ? nullptr : &at->second;
    }
    double setting(std::string_view setting, double otherwise) const {
        const auto at = settings.find(setting);
        return at == settings.end() ? otherwise : at->second;
    }
};

}  // namespace hal::ethercat::config
