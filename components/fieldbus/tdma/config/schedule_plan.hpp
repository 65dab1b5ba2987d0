// SPDX-License-Identifier: MIT
// The timing of a schedule: when each frame is on the wire, the load, the latency from an input to
// an output. Everything is [setup].
#pragma once

#include "schedule.hpp"

namespace hal::tdma::plan {

/// A frame's time on its sender's line, from the sync.
struct Entry {
    enum class What : std::uint8_t { sync, backup_sync, slot };
    What what = What::slot;
    std::size_t station = 0;
    unsigned id = 0;         ///< of the slot
    Time at = 0;
    Time until = 0;
    std::size_t bytes = 60;     ///< of the longest frame, without check sequence
    std::uint32_t period = 1;
    std::uint32_t phasing = 0;
    config::Span at_line{};
};

/// By their times.
std::vector<Entry> entries_of(const config::Schedule&);
/// There is a cycle in which both are used.
bool meet(const Entry&, const Entry&);

/// From an input of a station by way of the one that closes the loops to an output of the same
/// station. Times from the sync of the cycle in which the station's thread read the input.
struct RoundTrip {
    std::size_t station = 0;
    Time read = 0;         ///< the station's thread reads its inputs
    Time up = 0;           ///< its frame leaves, in its first slot, at worst
    Time up_arrives = 0;
    Time master = 0;       ///< that station's thread takes it and computes
    Time down = 0;         ///< its frame leaves, in its first slot, at worst
    Time down_arrives = 0;
    Time output = 0;       ///< the station's thread takes it
    Time worst = 0;        ///< of an input that changed just after it was read: a cycle more
    std::uint32_t cycles = 0;  ///< between reading and output
};

struct Plan {
    std::vector<Entry> entries;
    /// share of the time that frames take, all of their full length, slots by their period
    double load = 0.0;
    /// Who closes the loops: the master; when it has no slot and keeps the time alone, the first
    /// backup that has one; or nobody.
    std::optional<std::size_t> by_way_of;
    std::vector<RoundTrip> trips;  ///< of the other stations that have a slot
};
Plan plan_of(const config::Schedule&);

/// Between two stations, both with threads and slots, at worst. Times from the beginning of the
/// thread's cycle of `here`.
struct Way {
    std::size_t other = 0;
    Time there = 0;  ///< until the other's thread takes what this one's has written
    /// from a change of an input of the other, just after it was read, to the thread's cycle here
    Time back = 0;
    /// of this station's thread that begin meanwhile
    std::uint32_t there_cycles = 0;
    std::uint32_t back_cycles = 0;
    /// cycles until an input there that follows an output there is here
    std::uint32_t round_trip = 0;
};
/// From the slot of that number (place in the station's list) to all others that have one, and from
/// their first slots back.
std::vector<Way> ways_of(const config::Schedule&, std::size_t here, std::size_t slot);

}  // namespace hal::tdma::plan
