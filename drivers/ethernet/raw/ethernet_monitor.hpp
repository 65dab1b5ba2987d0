// SPDX-License-Identifier: MIT
// Monitors one interface in a thread of its own, so that no cycle has to: carrier, MTU, speed, loss
// and return under another number, frames dropped by the kernel, steps of the clock that stamps
// frames.
#pragma once

#include <atomic>
#include <optional>
#include <string>

#include "ethernet_interface.hpp"
#include "netlink/link_monitor.hpp"
#include "receiver.hpp"
#include "sender.hpp"

namespace hal::ethernet::rawether {

class EthernetMonitor {
public:
    /// Starts the thread. Both sockets are bound to `found`. [setup]
    EthernetMonitor(std::string name, const Interface& found, Receiver&, Sender&, RealTime&);

    std::atomic<std::uint32_t> speed{0};
    std::atomic<std::uint64_t> downs{0};
    std::atomic<std::uint64_t> lost{0};

private:
    void look();
    void take(const Interface&);

    const std::string name_;
    Receiver& receiver_;
    Sender& sender_;
    RealTime& clock_;
    int index_;
    link::Descriptor clock_steps_;
    std::optional<link::LinkMonitor> monitor_;  // the last one: its thread uses all of the above
};

}  // namespace hal::ethernet::rawether
