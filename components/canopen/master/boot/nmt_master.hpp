// SPDX-License-Identifier: MIT
// The NMT master of CiA 302-2 and 302-3: boots all nodes side by side, starts them, watches them, brings lost ones back.
// It owns no bus, no clock and no thread, and puts its frames into a queue that somebody else empties; usually that of the
// master's own node:
//
//     Device own(description, {.node_id = setup.id, .nmt_slave = false}, events);   // [setup]
//     Master master(setup, own.out(), events);
//     own.start(now), master.start(now);
//     each cycle:
//         while (link.receive(frame, now)) own.handle(frame, now), master.handle(frame, now);
//         own.poll(now), master.poll(now);
//         ... send what is in own.out() ...
//
// The application may submit its own SDO requests at any time: master.network().node(5)->sdo().submit(request).
#pragma once

#include <array>
#include <memory>
#include <span>

#include "canopen/master/network.hpp"
#include "node_setup.hpp"
#include "node_status.hpp"

namespace hal::canopen {

/// What the master tells. The calls of Events about nodes come, too: on_node(), on_emergency(). All from poll(), handle() or a command.
/// [realtime]
class MasterEvents : public Events {
public:
    /// `step` is a new one; the rest of it may be new, too.
    virtual void on_step(const NodeStatus&) noexcept {}
    /// NetworkStatus::state is a new one.
    virtual void on_network(const NetworkStatus&) noexcept {}
    /// What our own node shall be now: apply it, e.g. Device::command(). Not called when MasterSetup::start_self is false.
    virtual void on_own_state(NmtState) noexcept {}
};

class Master final : private Events {
public:
    /// Takes all memory. Throws std::invalid_argument with the first of problems_of(). [setup]
    Master(const MasterSetup&, FrameQueue& out, MasterEvents&);
    ~Master() override;

    /// Boots the network, from the beginning if it was started before. [realtime]
    void start(Time now) noexcept;
    /// Hands in every frame received; true: it was for the master. [realtime]
    bool handle(const Frame&, Time now) noexcept;
    /// Does what is due; once a cycle. [realtime]
    void poll(Time now) noexcept;

    /// Stops all nodes and leaves them stopped: until start(). [realtime]
    void stop(Time now) noexcept;
    /// The network is another master's: nothing is asked or told any more, until start(). [realtime]
    void stand_by(Time now) noexcept;
    /// A command to one node, or with id 0 to all. A node commanded so is not brought back by itself: stop and pre-operational hold until
    /// `start` or restart(); after a reset it is booted again. False: no such node. [realtime]
    bool command(NmtCommand, std::uint8_t id, Time now) noexcept;
    /// Boots it anew, even when it had failed: resets its communication first. False: no such node. [realtime]
    bool restart(std::uint8_t id, Time now) noexcept;
    /// Stops it and forgets it until restart(): it counts as not there, and not as mandatory. [realtime]
    bool remove(std::uint8_t id, Time now) noexcept;

    /// [realtime]
    const NetworkStatus& status() const noexcept { return status_; }
    /// Of a node that is not in the setup: one with result A. [realtime]
    const NodeStatus& status(std::uint8_t id) const noexcept;
    /// nullptr when it is not in the setup. [any]
    const NodeSetup* setup(std::uint8_t id) const noexcept;
    const MasterSetup& setup() const noexcept { return setup_; }
    Network& network() noexcept { return network_; }
    /// The newest time it was told. [realtime]
    Time now() const noexcept { return now_; }
    /// The node in words, the network in words; see status.hpp. [setup]
    std::string sentence(std::uint8_t id) const;
    std::string sentence() const;

private:
    class Node;
    struct Command {
        NmtCommand command;
        std::uint8_t id;
    };
    void on_node(std::uint8_t, NodeEvent, NmtState, Time) noexcept override;
    void on_emergency(std::uint8_t, const Emergency&) noexcept override;
    void boot_all(bool reset) noexcept;
    void halt(NetworkState, std::uint8_t because_of) noexcept;
    void reset_all(std::uint8_t because_of) noexcept;
    void schedule() noexcept;
    void update() noexcept;
    void set_state(NetworkState, std::uint8_t node) noexcept;
    void own_state(NmtState) noexcept;
    bool send(NmtCommand, std::uint8_t id) noexcept;
    void send_commands() noexcept;

    const MasterSetup setup_;
    FrameQueue& out_;
    MasterEvents& events_;
    Network network_;
    std::vector<std::unique_ptr<Node>> nodes_;
    std::array<Node*, 128> by_id_{};
    NetworkStatus status_{};
    std::vector<Command> commands_;  // that the inhibit time or a full queue holds back
    std::size_t commands_waiting_ = 0;
    NmtState own_state_ = NmtState::initialising;
    unsigned booting_ = 0, ready_ = 0;
    bool keeps_some_ = false, halted_ = false, started_together_ = false, was_operational_ = false, commanded_ = false, dirty_ = false;
    Time now_ = 0, polled_ = 0, last_command_ = 0;
};

}  // namespace hal::canopen
