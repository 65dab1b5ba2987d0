// SPDX-License-Identifier: MIT
// A write that changes a setting of a network interface.
#pragma once

#include <array>
#include <cstddef>
#include <cstring>
#include <string>

namespace hal::tools {

/// A request to the driver (ioctl SIOCETHTOOL, linux/ethtool.h), or a text for a file of the
/// kernel. It has no pointers: another process can repeat it.
struct SettingWrite {
    static constexpr std::size_t max_request = 128;

    std::string file{};  ///< the file; empty: a request
    std::string text{};  ///< for the file
    /// one of the structures of linux/ethtool.h, which begin with their command
    alignas(8) std::array<std::byte, max_request> request{};

    /// Returns the write that sends `command` with the values of `structure`.
    template <class Structure>
    static SettingWrite of(Structure structure, unsigned command) {
        static_assert(sizeof structure <= max_request);
        SettingWrite write;
        structure.cmd = command;
        std::memcpy(write.request.data(), &structure, sizeof structure);
        return write;
    }

    /// Carries it out. Returns 0 or errno. [setup]
    int run(const std::string& interface) const;
};

/// Sends a request to the driver of an interface, which may answer in it. Returns 0 or errno.
/// [setup]
int ask_driver(const std::string& interface, void* request);

}  // namespace hal::tools
