// SPDX-License-Identifier: MIT
// The senders of syncs that are not this station's master: what is known of their schedules, and
// the second master that was confirmed.
#pragma once

#include <array>
#include <optional>

#include "followers.hpp"
#include "station_core.hpp"

namespace hal::tdma {

/// A sender of syncs of another schedule, and that schedule.
struct Claimant {
    Address who{};
    std::uint32_t cycle = 0;
    std::uint32_t row = 0;  ///< consecutive consistent syncs
    Time scheduled = 0;
    Time every = 0;  ///< its cycle, ns
    Time offset = 0;  ///< its time - the local one, less the path delay of its syncs
    bool confirmed() const noexcept { return row >= confirmations; }
};

/// Follows the syncs of other schedules, and reports a second master. [realtime]
class OtherMasters {
public:
    /// The core must outlive it. [setup]
    explicit OtherMasters(StationCore& core) noexcept : core_(core) {}
    void restart() noexcept;
    /// Counts a cycle.
    void tick() noexcept;
    /// Reports that the second master is lost when it sent no sync for `gone_after`.
    void expire(Time now) noexcept;

    /// Returns true for a station that may send syncs: the addresses of the master and its backups
    /// in the schedule are an allow list. Counts and reports others.
    bool allows(const Address& master) noexcept;
    /// Updates and returns what is known of the sender's schedule. `arrived`: local.
    const Claimant& claim(const Decoded&, Time arrived) noexcept;
    /// Notes a confirmed second master, and reports it.
    void confirm(const Address&, const Followers&, Time now) noexcept;
    /// Notes another sync of the second master, if it is from that.
    void refresh(const Address& from, Time now) noexcept;

    /// Returns true while there is a second master.
    bool present() const noexcept { return heard_ != 0; }
    /// Returns true when the second master has been there for `duration` (ns).
    bool lasts(Time now, Time duration) const noexcept {
        return present() && now - since_ >= duration;
    }
    /// Returns when a received frame left its sender, in the schedule of the second master; nullopt
    /// without one.
    std::optional<SlotTime> left_at(Time arrived, std::size_t length) const noexcept;
    /// Returns true for the last second master.
    bool is(const Address& address) const noexcept { return address == other_; }
    /// Returns true when there were followers as the second master was first heard: the own
    /// schedule is kept.
    bool established() const noexcept { return established_; }

private:
    const Claimant* find(const Address&) const noexcept;

    StationCore& core_;
    std::array<Claimant, 4> claimants_{};
    std::size_t next_claimant_ = 0;
    Address other_{};
    Time heard_ = 0;  // its last sync, local; 0: none, or lost
    Time since_ = 0;  // its first one
    bool reported_ = false;
    bool established_ = false;
    EventGate other_gate_;
    EventGate unknown_gate_;
};

}  // namespace hal::tdma
