// SPDX-License-Identifier: MIT
// A TAP interface: the end of an Ethernet cable in the IP stack of this machine. Everything here is
// [setup], for one thread at a time.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "link/ethernet.hpp"
#include "link/system.hpp"

namespace hal::tap {

#pragma GCC visibility push(default)

using Ip = std::array<std::uint8_t, 4>;

struct Setup {
    std::string name;  ///< "hal0"; in "hal%d" the kernel inserts the first free number
    std::optional<ethernet::Address> address{};  ///< none: that of the kernel
    std::size_t mtu = 0;  ///< bytes; 0: that of the kernel
    std::optional<Ip> ip{};  ///< none: configured by other means
    unsigned prefix = 24;  ///< length of the network prefix, bits
};

class Interface {
public:
    /// Creates the interface, or opens an existing one that no other process uses, and brings it
    /// up. Returns the problem, or "".
    std::string open(const Setup&);

    /// Returns the name given by the kernel.
    const std::string& name() const noexcept { return name_; }
    /// Returns a descriptor that polls readable when a frame waits.
    int descriptor() const noexcept { return device_.get(); }
    /// Change a setting; the value is used for later problems too. Return the problem, or "".
    std::string set_ip(const Ip&);
    std::string set_mtu(std::size_t bytes);
    /// Shows a carrier or none, where the kernel supports it (Linux 5.0).
    void show_carrier(bool up) noexcept;

    /// Passes a frame to the IP stack; it is dropped while the interface is down.
    void write(std::span<const std::uint8_t> frame) noexcept {
        (void)!::write(device_.get(), frame.data(), frame.size());
    }
    /// Returns the length of the next frame of the IP stack; 0: none.
    std::size_t read(std::span<std::uint8_t> to) noexcept {
        const auto length = ::read(device_.get(), to.data(), to.size());
        return length > 0 ? static_cast<std::size_t>(length) : 0;
    }

private:
    std::string open_device();
    std::string by_hand() const;
    std::string cannot_set(const std::string& what) const;
    std::string apply_address();
    std::string apply_mtu();
    std::string apply_ip();
    std::string bring_up();

    Setup setup_;
    std::string name_;
    link::Descriptor device_, socket_;
};

/// Returns why `name` is not a valid interface name; empty: it is valid.
std::string wrong_name(std::string_view name);
/// Formats an address as in "192.168.2.10".
std::string to_string(const Ip&);

#pragma GCC visibility pop

}  // namespace hal::tap
