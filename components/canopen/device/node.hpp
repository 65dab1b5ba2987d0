// SPDX-License-Identifier: MIT
// A Program running as a device on a link. A process turns it in a loop, a component once per
// cycle.
//
//     Lamp lamp;
//     Node node(lamp, std::move(can::open("udp:239.74.163.2:43113").link), {.node_id = 5});   // [setup]
//     for (;;) node.link().wait(millisecond), node.turn(clock_now());
#pragma once

#include <array>
#include <memory>

#include "faults.hpp"
#include "program.hpp"

namespace hal::canopen {
/// Runs a Program on a link, with faults injected between the two. All functions are called by one
/// thread.

class Node {
public:
    /// Creates the device of the program, which must outlive the node. Throws std::invalid_argument
    /// with the first of Dictionary::problems() when the description is inconsistent. [setup]
    Node(Program&, std::unique_ptr<can::Link>, const DeviceSettings&);

    /// Does everything due at `now` (ns): boots on the first turn, handles received frames, steps
    /// the program, sends frames. [realtime]
    void turn(Time now) noexcept { turn(now, now); }
    /// The same for a link with a time base of its own, such as can::unclocked. [realtime]
    void turn(Time now, std::int64_t link_now) noexcept;
    /// Switches the power. Without power the device receives and sends nothing and loses what it
    /// has not stored. [realtime]
    void power(bool on) noexcept { powered_ = on; }

    Device& device() noexcept { return device_; }
    const Device& device() const noexcept { return device_; }
    can::Link& link() noexcept { return *link_; }
    Faults& faults() noexcept { return faults_; }
    bool powered() const noexcept { return powered_; }

private:
    void watch_bus(Time now) noexcept;
    void send(Time now, std::int64_t link_now) noexcept;

    Program& program_;
    Device& device_;
    std::unique_ptr<can::Link> link_;
    Faults faults_;
    FrameQueue bus_;  // behind the faults
    std::array<Frame, 64> heard_;
    bool powered_ = true;
    bool runs_ = false;
    bool booted_once_ = false;
    bool bus_off_ = false;
    bool watched_ = false;
};

}  // namespace hal::canopen
