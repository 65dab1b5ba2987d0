// SPDX-License-Identifier: MIT
// The SYNC: its primary sender listens before it leads. Backup k sends k offsets after the start of
// a cycle without SYNC.
#pragma once

#include "fieldbus/scocan/station/mode_control.hpp"

namespace hal::scocan {

/// The sender of SYNCs, in all nodes; those of other roles never lead. [realtime]
class SyncSender {
public:
    /// Both outlive it. [setup]
    SyncSender(StationCore& core, ModeControl& modes) noexcept : core_(core), modes_(modes) {}
    /// Forgets what came from the bus.
    void forget() noexcept;
    /// Ends the standby that a second SYNC node caused.
    void reset() noexcept { standby_ = false; }

    /// Decides whether this node begins to send the SYNC. Returns true when it starts a cycle
    /// itself.
    bool lead(Time now) noexcept;
    /// Sends the SYNC of a cycle, if this node does.
    void plan(std::uint64_t cycle) noexcept;
    /// Handles the echo of an own SYNC. Returns the number of cycles that began with it.
    std::uint64_t sent(Time begin) noexcept;
    /// Handles the SYNC of another node, if this one may send it too.
    void other_sent(const Sync&) noexcept;
    /// Notes the sender of an accepted SYNC.
    void follow(std::uint32_t sender) noexcept { leader_ = sender; }
    /// Sends the CRC of the table to all nodes.
    void announce_table() noexcept;

private:
    bool listened_long_enough(Time now) const noexcept;
    void set_leading(bool) noexcept;
    bool takes_over(std::uint64_t cycle) noexcept;
    can::Frame frame_of(std::uint64_t cycle) const noexcept;
    void send_at_once(std::uint64_t cycle, Time begin, Time at) noexcept;

    StationCore& core_;
    ModeControl& modes_;
    bool standby_ = false;  // another primary sends
    std::uint32_t leader_ = no_node;  // sender field of the last SYNC
};

}  // namespace hal::scocan
