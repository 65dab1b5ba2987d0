// SPDX-License-Identifier: MIT
// The tunnel's end in the kernel: a TAP interface (Documentation/networking/tuntap) and the ordinary thread that carries packets between
// it and the cycle's queues. The interface has the station's address, the MTU of its slot 1, and a carrier while the station may send.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "fieldbus/tdma/config/schedule.hpp"
#include "tunnel.hpp"

namespace hal::tdma {

struct TapSetup {
    std::string               name;         ///< "hal0", "rtmac%d": the kernel puts the first free number
    Address                   address{};    ///< of the port
    std::optional<config::Ip> ip{};         ///< nothing: somebody else gives it one
    unsigned                  prefix = 24;  ///< of its network, bits
};

class Tap;
struct OpenedTap {
    std::unique_ptr<Tap> tap;
    std::string          problem;  ///< a sentence: what, why, what to type
};

class Tap {
public:
    virtual ~Tap() = default;  ///< [setup] the interface goes with it, unless it was there before
    virtual const std::string& name() const noexcept = 0;  ///< as the kernel called it. [any]
    /// The station has another schedule now: the IP of its block, if it has one, and what slot 1 carries. The thread does it. [realtime]
    virtual void scheduled(const std::optional<config::Ip>& ip, std::size_t mtu) noexcept = 0;
};

/// Makes the interface, or takes one that is there and nobody else's, and starts the thread. The tunnel outlives it. [setup]
OpenedTap open_tap(Tunnel&, const TapSetup&, const std::string& instance);

/// Why it is no name of an interface, or nothing. [setup]
std::string wrong_name(std::string_view name);
/// Bits of a network's prefix, of "24" or "255.255.255.0"; nothing: it is none. [setup]
std::optional<unsigned> parse_prefix(std::string_view text);

}  // namespace hal::tdma
