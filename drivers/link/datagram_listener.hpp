// SPDX-License-Identifier: MIT
// The other side of link/datagram.hpp: a device that this process emulates, at an IP address of
// this computer. Everything here is [setup].
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "link/datagram.hpp"

namespace hal::datagram {

#pragma GCC visibility push(default)

class Listener {
public:
    virtual ~Listener() = default;
    Listener() = default;
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

    /// Waits for datagrams, at most for `wait_ns`, lets the server handle them, and sends the
    /// answers that are due. Times are those of CLOCK_MONOTONIC: of a datagram when the kernel
    /// received it, so that a device in a process that is scheduled late has the time of its wire.
    virtual void serve(Server& server, std::int64_t wait_ns) = 0;
    /// Hardware address of the interface that has the IP address; zeros: it has none.
    virtual const std::array<std::uint8_t, 6>& mac() const noexcept = 0;
    /// "10.10.10.10:27181"
    virtual const std::string& address() const noexcept = 0;
};

struct Listening {
    std::unique_ptr<Listener> listener;
    std::string problem;
    explicit operator bool() const noexcept { return listener != nullptr; }
};

/// Listens at `HOST` or `HOST:PORT`, an address of this computer: answers leave from the address
/// that was asked. `port` is for an address without one.
Listening listen(std::string_view address, std::uint16_t port);

#pragma GCC visibility pop

}  // namespace hal::datagram
