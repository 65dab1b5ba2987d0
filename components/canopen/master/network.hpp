// SPDX-License-Identifier: MIT
// What a master knows of the other nodes: for each an SDO client, its state by heartbeat or guarding, its emergencies.
// All nodes are served at once; none waits for another.
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

class RemoteNode {
public:
    RemoteNode(std::uint8_t id, FrameQueue& out, const SdoClientSettings& settings) : id_(id), out_(out), sdo_(out, settings) {
        sdo_.configure(id);
    }

    std::uint8_t id() const noexcept { return id_; }
    SdoClient& sdo() noexcept { return sdo_; }

    /// Silence of its heartbeat for that long is a loss; 0: it is not watched. Watching begins with the first one heard. [realtime]
    void expect_heartbeat(Time limit) noexcept { heartbeat_limit_ = limit; }
    /// Asks it every `period`; it is lost after `factor` periods without a good answer. 0: no guarding. [realtime]
    void guard(Time period, std::uint8_t factor, Time now) noexcept;

    bool guarded() const noexcept { return guard_period_ != 0; }
    /// It was lost although it answered guarding: with a toggle bit that did not change.
    bool toggle_stuck() const noexcept { return toggle_stuck_; }

    bool heard() const noexcept { return heard_; }
    bool lost() const noexcept { return lost_; }
    NmtState state() const noexcept { return state_; }
    Time last_heard() const noexcept { return last_; }
    std::uint64_t boot_ups() const noexcept { return boot_ups_; }
    std::uint64_t wrong_toggles() const noexcept { return wrong_toggles_; }

    static constexpr std::size_t history = 16;
    /// Emergency `n` counted back from the newest, 0 first; the time is 0 where there is none.
    const Emergency& emergency(std::size_t n) const noexcept {
        return emergencies_[(emergency_count_ + history * 2 - 1 - n % history) % history];
    }
    std::uint64_t emergencies() const noexcept { return emergency_count_; }
    std::uint8_t error_register() const noexcept { return error_register_; }

private:
    friend class Network;
    void on_error_control(const Frame&, Time now, Events&) noexcept;
    void on_emergency(const Frame&, Time now, Events&) noexcept;
    void poll(Time now, Events&) noexcept;

    const std::uint8_t id_;
    FrameQueue& out_;
    SdoClient sdo_;
    NmtState state_ = NmtState::initialising;
    bool heard_ = false, lost_ = false, watching_ = false;
    Time last_ = 0, heartbeat_limit_ = 0;
    Time guard_period_ = 0, next_guard_ = 0, answered_ = 0, wrong_at_ = 0, guard_heard_ = 0;
    std::uint8_t guard_factor_ = 0, toggle_ = 0;
    bool toggle_known_ = false, toggle_stuck_ = false;
    std::array<Emergency, history> emergencies_{};
    std::uint64_t emergency_count_ = 0, boot_ups_ = 0, wrong_toggles_ = 0;
    std::uint8_t error_register_ = 0;
};

class Network {
public:
    Network(FrameQueue& out, Events& events, const SdoClientSettings& settings = {}) : out_(out), events_(events), settings_(settings) {}

    /// The node, made if it was not known yet; id 1–127. [setup]
    RemoteNode& add(std::uint8_t id);
    /// nullptr when it was not added. [realtime]
    RemoteNode* node(std::uint8_t id) noexcept { return id < nodes_.size() ? nodes_[id].get() : nullptr; }
    /// To one node, or to all with id 0. False: no room. [realtime]
    bool command(NmtCommand, std::uint8_t id = 0) noexcept;
    /// True: it was for one of the nodes. [realtime]
    bool handle(const Frame&, Time now) noexcept;
    void poll(Time now) noexcept;

private:
    FrameQueue& out_;
    Events& events_;
    const SdoClientSettings settings_;
    std::array<std::unique_ptr<RemoteNode>, 128> nodes_{};
};

}  // namespace hal::canopen
