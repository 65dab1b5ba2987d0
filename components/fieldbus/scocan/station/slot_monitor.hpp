// SPDX-License-Identifier: MIT
// What is sent in the slots: frames outside of their slots, own and others', the slots that nobody
// used, and the monitor that announces them.
#pragma once

#include <array>

#include "fieldbus/scocan/station/mode_control.hpp"

namespace hal::scocan {

/// Checks what is sent in the slots. [realtime]
class SlotMonitor {
public:
    /// Both outlive it. [setup]
    SlotMonitor(StationCore& core, const ModeControl& modes) noexcept
        : core_(core), modes_(modes) {}
    void attach() noexcept;  ///< [setup]
    /// Forgets what came from the bus.
    void forget() noexcept;
    /// Forgives the offences of this node.
    void reset() noexcept;

    /// Checks a frame of another node.
    void check(const can::Frame&, const SlotTime&) noexcept;
    /// Checks an own frame that was sent, and counts it.
    void check_own(const can::Frame&, const SlotTime&, Time bus_begin) noexcept;
    /// Notes the announcement of an idle slot, by the monitor or by this node itself.
    void announced(const SlotTime&) noexcept;
    /// Notes that the monitor works.
    void monitor_heard() noexcept;
    /// Ends the account of a cycle.
    void close_cycle() noexcept;

    /// Returns the node whose identifier it is, or no_node.
    std::uint32_t owner_of(std::uint32_t id) const noexcept;
    std::uint32_t foreign_of(std::uint32_t id) const noexcept { return foreign_[id & 0x7ff]; }
    bool monitored() const noexcept { return monitored_; }

private:
    const Use* use_at(const SlotTime&) const noexcept;
    bool is_foreign(const can::Frame&, const SlotTime&) const noexcept;
    void offend(Event, const can::Frame&, Time value, Time bus_begin) noexcept;
    std::uint32_t count_idle() noexcept;

    StationCore& core_;
    const ModeControl& modes_;
    std::array<std::uint32_t, 2048> foreign_{};
    /// slots of this cycle with a frame, with an announcement
    std::array<bool, max_slots> seen_{}, announced_{};
    std::uint32_t foreign_in_cycle_ = 0;
    std::uint32_t foreign_id_ = 0;
    std::uint32_t unannounced_cycles_ = 0;
    std::uint32_t offences_ = 0;
    Time first_offence_ = 0;
    bool monitored_ = false;
    bool monitor_lost_ = false;
    bool babbled_ = false;
};

}  // namespace hal::scocan
