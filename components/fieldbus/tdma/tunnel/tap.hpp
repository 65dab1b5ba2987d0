// SPDX-License-Identifier: MIT
// The kernel end of the tunnel: a TAP interface (Linux, Documentation/networking/tuntap) and the
// ordinary thread that moves packets between it and the cycle's queues. The interface has the
// station's address, the MTU of its slot 1, and a carrier while the station may send.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "fieldbus/tdma/config/schedule.hpp"
#include "hal/message_log.hpp"
#include "tunnel.hpp"

namespace hal::tdma {

/// Settings of the interface.
struct TapSetup {
    /// "hal0"; in "hal%d" the kernel inserts the first free number
    std::string name;
    Address address{};    ///< of the port
    std::optional<config::Ip> ip{};         ///< none: configured by other means
    unsigned prefix = 24;  ///< length of the network prefix, bits
};

class Tap;
/// An open interface, or nullptr and the reason.
struct OpenedTap {
    std::unique_ptr<Tap> tap;
    std::string problem;  ///< a message: what failed, why, what to type
};

/// A TAP interface with its thread.
class Tap {
public:
    virtual ~Tap() = default;  ///< removes the interface, unless it existed before. [setup]
    virtual const std::string& name() const noexcept = 0;  ///< the name given by the kernel. [any]
    /// Passes a new schedule to the thread: the IP of the block, if any, and the MTU of slot 1.
    /// [realtime]
    virtual void scheduled(const std::optional<config::Ip>& ip, std::size_t mtu) noexcept = 0;
};

/// Creates the interface, or opens an existing one that no other process uses, and starts the
/// thread. The tunnel must outlive it. [setup]
OpenedTap open_tap(Tunnel&, const TapSetup&, const hal::LinePrefix& prefix);

/// Returns why `name` is not a valid interface name; empty: it is valid. [setup]
std::string wrong_name(std::string_view name);
/// Parses a prefix length "24" or a netmask "255.255.255.0" into bits; nothing when it is invalid.
/// [setup]
std::optional<unsigned> parse_prefix(std::string_view text);

}  // namespace hal::tdma
