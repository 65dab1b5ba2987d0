// SPDX-License-Identifier: MIT
// Recognises a second master with the schedule of the first one: its syncs have the same numbers and
// times, because two segments were joined whose masters began together. A master
// that takes over sends instead of the last one, this one beside it.
#pragma once

#include <cstdint>

#include "station_core.hpp"

namespace hal::tdma {

/// Counts the consecutive syncs that another station sent beside those of the present master.
/// [realtime]
class ParallelMaster {
public:
    void restart() noexcept { *this = {}; }
    /// Notes a sync of the present master, sent at its scheduled time.
    void note_master(std::uint32_t cycle) noexcept {
        master_known_ = true;
        master_cycle_ = cycle;
    }
    /// The present master is a backup, which a master may replace.
    void note_backup() noexcept { restart(); }
    /// Notes a sync of another station, sent at its scheduled time. Returns true when the present
    /// master sent one since the last sync of that station.
    bool note_other(const Address& who, std::uint32_t cycle) noexcept {
        const bool again = other_known_ && who == other_;
        const bool parallel =
            again && master_known_ && static_cast<std::int32_t>(master_cycle_ - other_cycle_) >= 0;
        row_ = parallel ? row_ + 1 : 0;
        other_known_ = true;
        other_ = who;
        other_cycle_ = cycle;
        return parallel;
    }
    bool confirmed() const noexcept { return row_ >= confirmations; }

private:
    bool master_known_ = false;
    std::uint32_t master_cycle_ = 0;  // of its last sync
    bool other_known_ = false;
    Address other_{};
    std::uint32_t other_cycle_ = 0;  // of its last sync
    std::uint32_t row_ = 0;  // its consecutive syncs beside the master's
};

}  // namespace hal::tdma
