// SPDX-License-Identifier: MIT
// A Program at work: its device on a link. A process turns it in a loop, a component in its cycle.
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

class Node {
public:
    /// The program outlives the node. Throws std::invalid_argument when the description does not hold together: the first of
    /// Dictionary::problems(). [setup]
    Node(Program&, std::unique_ptr<can::Link>, const DeviceSettings&);

    /// Everything that is due at `now`: the first turn boots; frames are taken, the program steps, what it has to say is sent. All by
    /// one thread. [realtime]
    void turn(Time now) noexcept { turn(now, now); }
    /// The same for a link that is told another time than the device, such as can::unclocked. [realtime]
    void turn(Time now, std::int64_t link_now) noexcept;
    /// Without power the device is silent, and forgets what was not stored. [realtime]
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
    bool powered_ = true, runs_ = false, booted_once_ = false, bus_off_ = false, watched_ = false;
};

}  // namespace hal::canopen
