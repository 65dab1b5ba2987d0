// SPDX-License-Identifier: MIT
// The remote nodes of a network: for each node an SDO client, its NMT state by heartbeat or node
// guarding, and its emergencies. All nodes are served concurrently.
#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "canopen/protocol/emcy.hpp"
#include "canopen/protocol/events.hpp"
#include "canopen/protocol/frames.hpp"
#include "canopen/protocol/lss_master.hpp"
#include "canopen/protocol/sdo_client.hpp"

namespace hal::canopen {

/// One remote node as the master sees it. All calls belong to one thread.
class RemoteNode {
public:
    /// Creates the node with its default SDO channel; the queue outlives it. [setup]
    RemoteNode(std::uint8_t id, FrameQueue& out, const SdoClientSettings& settings)
        : id_(id), out_(out), sdo_(out, settings) {
        sdo_.configure(id);
    }

    /// Returns the node ID. [any]
    std::uint8_t id() const noexcept { return id_; }
    /// Returns the SDO client of the node. [realtime]
    SdoClient& sdo() noexcept { return sdo_; }

    /// Supervises the heartbeat with a timeout of `limit` ns, from the first heartbeat on; 0: no
    /// supervision. [realtime]
    void expect_heartbeat(Time limit) noexcept { heartbeat_limit_ = limit; }
    /// Guards the node every `period` ns; it is lost after `factor` periods without a valid
    /// response. 0: no guarding. [realtime]
    void guard(Time period, std::uint8_t factor, Time now) noexcept;

    /// Returns true if node guarding is on. [realtime]
    bool guarded() const noexcept { return guard_period_ != 0; }
    /// Returns true if the node was lost because the toggle bit of its guarding responses did not
    /// alternate. [realtime]
    bool toggle_stuck() const noexcept { return toggle_stuck_; }

    /// Returns true once a heartbeat, boot-up message or guarding response was received. [realtime]
    bool heard() const noexcept { return heard_; }
    /// Returns true while heartbeat or guarding is timed out. [realtime]
    bool lost() const noexcept { return lost_; }
    /// Returns the NMT state as last received. [realtime]
    NmtState state() const noexcept { return state_; }
    /// Returns the time of the last heartbeat, boot-up message or guarding response. [realtime]
    Time last_heard() const noexcept { return last_; }
    /// Returns the number of boot-up messages. [realtime]
    std::uint64_t boot_ups() const noexcept { return boot_ups_; }
    /// Returns the number of guarding responses with a wrong toggle bit. [realtime]
    std::uint64_t wrong_toggles() const noexcept { return wrong_toggles_; }

    static constexpr std::size_t history = 16;  ///< emergencies kept
    /// Returns emergency `n`, 0 being the newest; time 0: not received. [realtime]
    const Emergency& emergency(std::size_t n) const noexcept {
        return emergencies_[(emergency_count_ + history * 2 - 1 - n % history) % history];
    }
    /// Returns the number of emergencies received. [realtime]
    std::uint64_t emergencies() const noexcept { return emergency_count_; }
    /// Returns 1001h as the newest emergency carried it. [realtime]
    std::uint8_t error_register() const noexcept { return error_register_; }

private:
    friend class Network;
    void on_error_control(const Frame&, Time now, DeviceEvents&) noexcept;
    void on_emergency(const Frame&, Time now, DeviceEvents&) noexcept;
    void poll(Time now, DeviceEvents&) noexcept;

    const std::uint8_t id_;
    FrameQueue& out_;
    SdoClient sdo_;
    NmtState state_ = NmtState::initialising;
    bool heard_ = false;
    bool lost_ = false;
    bool watching_ = false;
    Time last_ = 0;
    Time heartbeat_limit_ = 0;
    Time guard_period_ = 0;
    Time next_guard_ = 0;
    Time answered_ = 0;
    Time wrong_at_ = 0;
    Time guard_heard_ = 0;
    std::uint8_t guard_factor_ = 0;
    std::uint8_t toggle_ = 0;
    bool toggle_known_ = false;
    bool toggle_stuck_ = false;
    std::array<Emergency, history> emergencies_{};
    std::uint64_t emergency_count_ = 0;
    std::uint64_t boot_ups_ = 0;
    std::uint64_t wrong_toggles_ = 0;
    std::uint8_t error_register_ = 0;
};

/// All remote nodes of a bus. All calls belong to one thread.
class Network {
public:
    /// Creates an empty network; queue and events outlive it. [setup]
    Network(FrameQueue& out, DeviceEvents& events, const SdoClientSettings& settings = {})
        : out_(out), events_(events), settings_(settings) {}

    /// Returns the node, creating it if necessary; id 1..127. [setup]
    RemoteNode& add(std::uint8_t id);
    /// Returns the node; nullptr if it was not added. [realtime]
    RemoteNode* node(std::uint8_t id) noexcept {
        return id < nodes_.size() ? nodes_[id].get() : nullptr;
    }
    /// Sends an NMT command to one node, or to all with id 0. Returns false if the queue is full.
    /// [realtime]
    bool command(NmtCommand, std::uint8_t id = 0) noexcept;
    /// Processes a frame; returns true if it belongs to one of the nodes. [realtime]
    bool handle(const Frame&, Time now) noexcept;
    /// Polls all nodes; call it once per cycle. [realtime]
    void poll(Time now) noexcept;

private:
    FrameQueue& out_;
    DeviceEvents& events_;
    const SdoClientSettings settings_;
    std::array<std::unique_ptr<RemoteNode>, 128> nodes_{};
};

}  // namespace hal::canopen
