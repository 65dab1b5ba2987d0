// SPDX-License-Identifier: MIT
// What the parts of a station share: its part of the schedule, its state, the global clock, and the
// grid of cycles in global time. Only the station's thread changes them. Other threads read
// `thread`, and `address` and `setup.others`, which stay the same while the station has a port.
// Under a journal all threads take turns with `order` at the queues of the slots.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdlib>

#include "clock_estimate.hpp"
#include "discipline/discipline.hpp"
#include "link/call_order.hpp"
#include "station_setup.hpp"

namespace hal::tdma {

/// Consecutive observations that confirm something: a single frame may be anything.
inline constexpr std::uint32_t confirmations = 3;
/// ns without frames: a second master, or a station that sends, is lost.
inline constexpr Time gone_after = 1'000'000'000;

/// Lets an event pass, then not again for 1000 cycles.
class EventGate {
public:
    bool open() const noexcept { return left_ == 0; }
    void close() noexcept { left_ = 1000; }
    /// Returns true when the event may be reported now.
    bool pass() noexcept {
        if (!open()) return false;
        close();
        return true;
    }
    /// Counts a cycle.
    void tick() noexcept {
        if (left_ != 0) {
            --left_;
        }
    }

private:
    std::uint32_t left_ = 0;
};

/// A scheduled sync: the number of its cycle, which wraps, and its global time.
struct CycleStart {
    std::uint32_t number = 0;
    Time start = 0;
};

/// A moment within a cycle of the schedule, ns after its sync.
struct SlotTime {
    std::uint32_t cycle = 0;
    Time offset = 0;
};

/// The shared part. [realtime]
struct StationCore {
    StationSetup setup;
    Status status;
    ClockEstimate clock;
    CycleStart grid;
    bool grid_known = false;
    /// this master was the first: its clock is the global time
    bool own_schedule = false;
    Address address{};
    ethernet::Port* port = nullptr;
    Events* events = nullptr;
    std::atomic<pthread_t> thread{};  ///< that of receive()
    mutable link::CallOrder order;  ///< of the calls of all threads on the queues
    /// The station has stopped sending, and frames queued before that are still to be dropped.
    bool has_stale_frames = false;

    void report(Event event, const Address& who = {}, Time value = 0) noexcept {
        if (events != nullptr) {
            events->on_event(event, who, value);
        }
    }
    /// Returns true in the thread of receive(). [any]
    bool is_own_thread() const noexcept {
        return thread.load(std::memory_order_relaxed) == link::calling_thread();
    }
    /// Returns true when the station runs and knows the present cycle.
    bool runs() const noexcept { return status.state == State::running && grid_known; }
    /// Returns the global time of the sync of a cycle near the present one.
    Time start_of(std::uint32_t cycle) const noexcept {
        const auto distance = static_cast<std::int32_t>(cycle - grid.number);
        return grid.start + static_cast<Time>(distance) * setup.cycle;
    }
    /// Returns true when a sync belongs to this schedule.
    bool fits(const Sync& sync) const noexcept {
        return grid_known && std::abs(sync.scheduled - start_of(sync.cycle)) <= setup.cycle / 8;
    }
    /// Returns the number of whole cycles in a time, rounded down.
    Time cycles_in(Time time) const noexcept {
        if (time >= 0) return time / setup.cycle;
        return -((-time + setup.cycle - 1) / setup.cycle);
    }
    /// Returns true for the lateness of a master's sync, false for a backup's.
    bool is_from_master(Time lateness) const noexcept {
        const Time limit = setup.backup_from != 0 ? setup.backup_from / 2 : setup.guard;
        return lateness <= limit && lateness >= -limit;
    }
    /// Returns when a received frame left its sender, if that is as far away as the master.
    SlotTime left_at(Time arrived, std::size_t length) const noexcept {
        const Time longer = 2 * (wire(length) - wire(0));  // stored and forwarded once
        const Time into = clock.global(arrived) - status.delay - longer - grid.start;
        const Time cycles = cycles_in(into);
        return {grid.number + static_cast<std::uint32_t>(cycles), into - cycles * setup.cycle};
    }
    Time wire(std::size_t length) const noexcept { return wire_time(ethernet::wire_bytes(length)); }
    Time wire_time(std::size_t wire_bytes) const noexcept {
        const std::uint32_t speed = setup.speed == 0 ? 100 : setup.speed;
        return static_cast<Time>(wire_bytes) * 8000 / static_cast<Time>(speed);
    }
};

/// Returns how much later than scheduled a sync was sent, ns.
inline Time lateness_of(const Sync& sync) noexcept {
    return static_cast<Time>(static_cast<std::uint64_t>(sync.stamp) -
                             static_cast<std::uint64_t>(sync.scheduled));
}

}  // namespace hal::tdma
