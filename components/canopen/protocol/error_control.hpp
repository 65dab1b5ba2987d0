// SPDX-License-Identifier: MIT
// Error control (CiA 301): heartbeat producer (1017h) and consumer (1016h), node guarding response
// and life guarding (100Ch, 100Dh).
#pragma once

#include <array>

#include "dictionary.hpp"
#include "events.hpp"
#include "frames.hpp"

namespace hal::canopen {

/// The error control of a node.
class ErrorControl final : public Handler {
public:
    /// Creates the service; both arguments outlive it. [setup]
    ErrorControl(Dictionary&, FrameQueue& out);
    /// Reads all parameters after a communication reset. [realtime]
    void reset(std::uint8_t node_id) noexcept;
    /// Sends the boot-up message, then the heartbeat. [realtime]
    void boot(Time now) noexcept;
    /// Sets the NMT state that heartbeat and guarding responses carry. [realtime]
    void set_state(NmtState state) noexcept { state_ = state; }

    /// Processes a frame; returns true if it belongs to error control. [realtime]
    bool handle(const Frame&, Time now, DeviceEvents&) noexcept;
    /// What changed in a poll().
    struct Change {
        /// the heartbeat of a consumed node or the guarding of the master timed out
        bool lost = false;
        std::uint8_t node = 0;   ///< its node ID; 0: the master
        bool recovered = false;  ///< no timeout is active any more
    };
    /// Sends the heartbeat when it is due and checks all timeouts. [realtime]
    Change poll(Time now, DeviceEvents&) noexcept;

    /// Returns true if no node of 1016h and no life guarding has timed out. Nodes never received do
    /// not count as lost. [realtime]
    bool all_alive() const noexcept { return lost_ == 0 && !life_lost_; }
    /// Returns true if another device used this node ID since the communication reset. [realtime]
    bool collided() const noexcept { return collided_; }

    Abort writing(Entry&, std::span<const std::uint8_t>) noexcept override;
    void written(Entry&) noexcept override;

private:
    struct Consumer {
        std::uint8_t node = 0;
        Time limit = 0;
        Time heard = 0;
        bool watching = false;
        bool lost = false;
        NmtState state = NmtState::initialising;
    };
    void read_consumer(const Entry&) noexcept;
    void read_producer() noexcept;
    void send_boot_up() noexcept;
    void answer_guarding(Time now, DeviceEvents&) noexcept;
    void on_heartbeat(std::uint8_t node, NmtState, Time now, DeviceEvents&) noexcept;

    Dictionary& dictionary_;
    FrameQueue& out_;
    std::uint8_t node_id_ = 0;
    NmtState state_ = NmtState::initialising;
    Time period_ = 0;
    Time next_ = 0;
    bool booted_ = false;
    bool boot_pending_ = false;
    bool due_now_ = false;
    // life guarding
    Time life_time_ = 0;
    Time guarded_ = 0;
    bool guarding_ = false;
    bool life_lost_ = false;
    std::uint8_t toggle_ = 0;
    std::array<Consumer, 128> consumers_{};
    std::size_t highest_ = 0;
    unsigned lost_ = 0;
    bool collided_ = false;
};

}  // namespace hal::canopen
