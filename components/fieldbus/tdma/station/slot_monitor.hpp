// SPDX-License-Identifier: MIT
// What the other stations send, compared with the schedule: who sent a frame, whether it was in a
// slot of its sender, and frames in the slots of this station.
#pragma once

#include <deque>
#include <optional>
#include <span>

#include "roster.hpp"
#include "slots.hpp"
#include "station_core.hpp"

namespace hal::tdma {

/// Checks the frames of other stations against the schedule. [realtime]
class SlotMonitor {
public:
    using Origin = ethernet::Discipline::Origin;

    /// The core must outlive it. [setup]
    explicit SlotMonitor(StationCore& core) noexcept : core_(core) {}
    /// Allocates the roster for the stations of the setup. [setup]
    void set_up() { roster_ = Roster(core_.setup.others.size()); }
    void clear() noexcept { roster_.clear(); }
    /// Forgets the frames in own slots, at a new start of the station.
    void restart() noexcept { intruder_row_ = 0; }
    /// Counts a cycle.
    void tick(Time now) noexcept;

    /// Notes a frame of another station.
    void note(const Decoded&, Time arrived, std::size_t length, Time now) noexcept;
    /// Notes a time stamp of station `n` in global time: two of them give its drift.
    void stamp(std::size_t n, Time its, Time global) noexcept { roster_.stamp(n, its, global); }
    /// Detects frames of other stations in own slots; needs the path delay.
    void check_own_slots(const std::deque<Slot>&, const Address& from, Time arrived,
                         std::size_t length) noexcept;
    /// Returns true for a frame that began in a slot of its sender in the other master's schedule,
    /// `there`, and not in this one.
    bool is_elsewhere(const Address& from, Time arrived, std::size_t length,
                      SlotTime there) const noexcept;
    /// With two schedules on the segment, nothing is learned from the slots of frames. [realtime]
    void learn(bool on) noexcept { learns_ = on; }
    /// Returns how a frame fits the schedule. With a schedule from RTcfg a station knows its
    /// own block only, and accepts all senders.
    Origin origin(const Address& from, Time arrived, std::size_t length) const noexcept;

    const Roster& roster() const noexcept { return roster_; }

private:
    bool may_send(const Other&, const Address& from, bool named) const noexcept;
    bool is_in_slot(const Other&, SlotTime) const noexcept;
    Time after_slot(const std::vector<SlotSetup>&, SlotTime) const noexcept;
    std::optional<std::size_t> block_at(SlotTime) const noexcept;
    bool is_unknown(std::size_t n) const noexcept;
    std::optional<std::size_t> sender_of(const Decoded&, Time arrived,
                                         std::size_t length) const noexcept;
    std::optional<std::size_t> by_address(const Address&) const noexcept;
    std::optional<std::size_t> by_slot(Time arrived, std::size_t length) const noexcept;
    std::optional<std::size_t> by_role(const Sync&) const noexcept;
    void check_block(std::size_t n, Time arrived, std::size_t length) noexcept;
    void check_duplicate(const Address& from, Time arrived, std::size_t length) noexcept;

    StationCore& core_;
    Roster roster_;
    bool learns_ = true;
    Address duplicate_{};  // the last sender in the slots of another station
    std::uint32_t duplicate_row_ = 0;
    std::uint32_t intruder_row_ = 0;
    EventGate duplicate_gate_;
    EventGate intruder_gate_;
};

}  // namespace hal::tdma
