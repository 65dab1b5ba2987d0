// SPDX-License-Identifier: MIT
// The NMT master of CiA 302-2 and CiA 302-3: boots all nodes concurrently, starts and supervises
// them, and recovers lost ones. It owns neither bus, clock nor thread; its frames go to a queue,
// usually that of the master's own node:
//
//     Device own(description, {.node_id = setup.id, .nmt_slave = false}, events);   // [setup]
//     Master master(setup, own.out(), events);
//     own.start(now), master.start(now);
//     each cycle:
//         while (link.receive(frame, now)) own.handle(frame, now), master.handle(frame, now);
//         own.poll(now), master.poll(now);
//         while (own.out().pop(frame)) link.send(frame, now);
//
// The application may submit its own SDO requests at any time:
// master.network().node(5)->sdo().submit(request).
#pragma once

#include <array>
#include <memory>
#include <span>

#include "canopen/master/network.hpp"
#include "node_setup.hpp"
#include "node_status.hpp"

namespace hal::canopen {

/// Notifications of the master, besides DeviceEvents::on_node() and on_emergency(). All calls come
/// from poll(), handle() or a command, in the middle of a boot: they must not command the master.
/// [realtime]
class MasterEvents : public DeviceEvents {
public:
    /// NodeStatus::step changed; other members may have changed as well.
    virtual void on_step(const NodeStatus&) noexcept {}
    /// NetworkStatus::state changed.
    virtual void on_network(const NetworkStatus&) noexcept {}
    /// The master's own node must enter this NMT state, for example by Device::command(). Not
    /// called if MasterSetup::start_self is false.
    virtual void on_own_state(NmtState) noexcept {}
};

/// The NMT master. All calls belong to one thread.
class Master final : private DeviceEvents {
public:
    /// Allocates all memory; queue and events outlive it. Throws std::invalid_argument with the
    /// first of problems_of(). [setup]
    Master(const MasterSetup&, FrameQueue& out, MasterEvents&);
    ~Master() override;

    /// Boots the network, from the beginning if it was already started. [realtime]
    void start(Time now) noexcept;
    /// Processes a received frame; returns true if it belongs to the master. [realtime]
    bool handle(const Frame&, Time now) noexcept;
    /// Does what is due; call it once per cycle. [realtime]
    void poll(Time now) noexcept;

    /// Stops all nodes until start(). [realtime]
    void stop(Time now) noexcept;
    /// Leaves the network to another master: sends nothing until start(). [realtime]
    void stand_by(Time now) noexcept;
    /// Sends an NMT command to one node, or with id 0 to all. Stop and pre-operational persist
    /// until start or restart(); after a reset the node is booted again. Returns false if the node
    /// is not in the set-up. [realtime]
    bool command(NmtCommand, std::uint8_t id, Time now) noexcept;
    /// Resets the communication of a node and boots it, even if it had failed. Returns false if the
    /// node is not in the set-up. [realtime]
    bool restart(std::uint8_t id, Time now) noexcept;
    /// Stops a node and removes it until restart(); it no longer counts as mandatory. Returns false
    /// if the node is not in the set-up. [realtime]
    bool remove(std::uint8_t id, Time now) noexcept;

    /// Returns the state of the network. [realtime]
    const NetworkStatus& status() const noexcept { return status_; }
    /// Returns the state of a node; result A if it is not in the set-up. [realtime]
    const NodeStatus& status(std::uint8_t id) const noexcept;
    /// Returns the set-up of a node, or nullptr for an unknown node. [any]
    const NodeSetup* setup(std::uint8_t id) const noexcept;
    /// Returns the set-up. [any]
    const MasterSetup& setup() const noexcept { return setup_; }
    /// Returns the remote nodes, for SDO requests of the application. [realtime]
    Network& network() noexcept { return network_; }
    /// Returns the time of the last call. [realtime]
    Time now() const noexcept { return now_; }
    /// Returns the largest use of the memory of a node's tasks so far, in bytes, of the
    /// BootChannel::task_bytes that each node has. [any]
    std::size_t max_task_memory() const noexcept;
    /// Returns the state of a node as a sentence; see node_status.hpp. [setup]
    std::string sentence(std::uint8_t id) const;
    /// Returns the state of the network as a sentence. [setup]
    std::string sentence() const;

private:
    class Node;
    struct Command {
        NmtCommand command;
        std::uint8_t id;
    };
    void on_node(std::uint8_t, NodeEvent, NmtState, Time) noexcept override;
    void on_emergency(std::uint8_t, const Emergency&) noexcept override;
    void on_foreign_command(std::uint8_t command, std::uint8_t id) noexcept;
    void boot_all(bool reset) noexcept;
    void halt(NetworkState, std::uint8_t because_of) noexcept;
    void reset_all(std::uint8_t because_of) noexcept;
    void schedule() noexcept;
    void start_together() noexcept;
    void count_nodes() noexcept;
    std::uint8_t find_culprit() const noexcept;
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
    std::vector<Command> commands_;  // delayed by the inhibit time or a full queue
    std::size_t commands_waiting_ = 0;
    NmtState own_state_ = NmtState::initialising;
    unsigned booting_ = 0;
    unsigned ready_ = 0;
    bool keeps_some_ = false;
    bool halted_ = false;
    bool started_together_ = false;
    bool was_operational_ = false;

    bool commanded_ = false;
    bool dirty_ = false;
    Time now_ = 0;
    Time polled_ = 0;
    Time last_command_ = 0;
};

}  // namespace hal::canopen
