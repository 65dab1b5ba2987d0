// SPDX-License-Identifier: MIT
// Watches one interface from a thread of its own, so that no cycle has to: carrier, MTU, speed, gone and back under another number,
// what the kernel had to drop, steps of the clock that it stamps with.
#pragma once

#include <atomic>
#include <string>
#include <thread>

#include "rawether/interface.hpp"
#include "rawether/receiver.hpp"
#include "rawether/sender.hpp"

namespace hal::ethernet::rawether {

class Keeper {
public:
    /// Both sockets are bound to `found`. [setup]
    Keeper(std::string name, const Interface& found, Receiver&, Sender&, RealTime&);
    ~Keeper();

    std::atomic<std::uint32_t> speed{0};
    std::atomic<std::uint64_t> downs{0}, lost{0};

private:
    void run();
    void look();
    void take(const Interface&);

    const std::string name_;
    Receiver& receiver_;
    Sender& sender_;
    RealTime& clock_;
    int index_;
    can::Descriptor events_, clock_steps_, wake_;
    std::atomic<bool> ending_{false};
    std::thread thread_;
};

}  // namespace hal::ethernet::rawether
