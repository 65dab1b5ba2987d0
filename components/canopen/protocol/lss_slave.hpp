// SPDX-License-Identifier: MIT
// The LSS slave (CiA 305), a part of every Device.
#pragma once

#include "events.hpp"
#include "frames.hpp"
#include "lss.hpp"

namespace hal::canopen {

/// Receives node ID and bit rate from an LSS master. All calls belong to one thread.
class LssSlave {
public:
    /// Creates the slave; both arguments outlive it. [setup]
    LssSlave(FrameQueue& out, DeviceEvents& events) noexcept : out_(out), events_(events) {}
    /// Sets identity (1018h) and active node ID. [realtime]
    void configure(const Identity& identity, std::uint8_t node_id) noexcept {
        identity_ = identity;
        active_id_ = pending_id_ = node_id;
    }
    /// Processes a frame; returns true if it is an LSS request. [realtime]
    bool handle(const Frame&) noexcept;
    /// Sends a response that did not fit into the queue. [realtime]
    void poll() noexcept {
        if (waiting_answer_) {
            waiting_answer_ = !out_.push(answer_);
        }
    }
    /// Returns the node ID that applies after the next communication reset. [realtime]
    std::uint8_t pending_id() const noexcept { return pending_id_; }
    /// Makes the pending node ID the active one. [realtime]
    void activate_pending_id() noexcept {
        active_id_ = pending_id_;
        wants_reset_ = false;
    }
    /// Returns true once a node without ID has received one and must reset its communication.
    /// [realtime]
    bool wants_reset() const noexcept { return wants_reset_; }
    /// Returns true in LSS configuration state. [realtime]
    bool configuring() const noexcept { return configuring_; }

private:
    void answer(std::uint8_t command, std::uint32_t value = 0) noexcept;
    void select(unsigned part, std::uint32_t value) noexcept;
    void identify(unsigned step, std::uint32_t value) noexcept;
    void fastscan(const Frame&) noexcept;
    void configure_bit_timing(const Frame&) noexcept;
    void configure_node_id(std::uint8_t id) noexcept;
    void activate_bit_timing(std::uint16_t delay_ms) noexcept;
    void switch_global(std::uint8_t mode) noexcept;
    bool is_unconfigured() const noexcept;
    bool is_in_bound(unsigned step, std::uint32_t value) const noexcept;
    bool handle_in_any_state(const Frame&) noexcept;
    void handle_configuration(const Frame&) noexcept;

    FrameQueue& out_;
    DeviceEvents& events_;
    Identity identity_{};
    std::uint8_t active_id_ = unconfigured;
    std::uint8_t pending_id_ = unconfigured;
    std::uint32_t pending_rate_ = 0;
    bool configuring_ = false;
    bool wants_reset_ = false;
    bool waiting_answer_ = false;
    std::uint8_t selected_ = 0;
    std::uint8_t identified_ = 0;  // matching steps so far
    std::uint8_t scan_part_ = 0;
    Frame answer_;
};

}  // namespace hal::canopen
