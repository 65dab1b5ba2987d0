// SPDX-License-Identifier: MIT
// Between a discipline, which decides when frames may leave on an Ethernet segment (TDMA), and the other users of that segment, which hand it
// their frames. Whoever runs a discipline offers it for its port; whoever opens a port on the same line obtains a handle:
//
//     offer_discipline(*port, &station, times);                   // [setup] the component tdma
//     std::shared_ptr<DisciplineHandle> h = discipline_of(*port); // [setup] a cane: link
//     h->with([&](Discipline& d) { d.send(frame, slot, 8); });    // [realtime]
#pragma once

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <vector>

#include "link/can.hpp"
#include "link/ethernet.hpp"

namespace hal::ethernet {

#pragma GCC visibility push(default)

/// Decides when frames may leave on its segment.
class Discipline {
public:
    virtual ~Discipline() = default;
    /// Queues a frame for slot `slot` (RTnet's slot id; 0 the default one), `priority` 0 first … 31 last. It leaves in the slot's next
    /// turn; `full`: that turn belongs to frames as urgent already, and the caller keeps this one. [realtime] the thread of the discipline's
    /// transmit function. `finisher` as of Launch
    virtual Sent send(std::span<const std::uint8_t> frame, unsigned slot, unsigned priority, Finisher* finisher = nullptr) noexcept = 0;
    /// Payload bytes that a frame in this slot may have; 0: there is no such slot. [any]
    virtual std::size_t room(unsigned slot) const noexcept = 0;
    /// The station may send: synchronous and calibrated. [any]
    virtual bool ready() const noexcept = 0;
    virtual const Address& address() const noexcept = 0;  ///< [any]

    /// Whether a station may have sent a frame that arrived at that time.
    enum class Origin : std::uint8_t {
        plausible,
        stranger,     ///< an address that the configuration excludes
        out_of_slot,  ///< not in a slot of that station
    };
    /// `length` of the whole frame. [realtime] the thread of the discipline
    virtual Origin origin(const Address& /*from*/, std::int64_t /*arrived_ns*/, std::size_t /*length*/) const noexcept {
        return Origin::plausible;
    }
};

/// The delivery times by way of each slot, where the schedule is known beforehand.
using SlotTimes = std::map<unsigned, std::vector<can::DeliveryTime>>;

/// A user's access to the discipline of a line. The discipline may be withdrawn and another one offered while the user is at work.
class DisciplineHandle {
public:
    /// Calls `use` with the discipline, which stays until that returns; returns false, and does nothing, when there is none. [realtime]
    template <class Use>
    bool with(Use use) noexcept {
        users_.fetch_add(1);
        Discipline* const now = discipline_.load();
        if (now != nullptr) use(*now);
        users_.fetch_sub(1);
        return now != nullptr;
    }
    /// Returns how long values take by way of that slot; empty: not known. [setup]
    std::vector<can::DeliveryTime> delivery_times(unsigned slot) const;
    /// Replaces the discipline; nullptr withdraws it. Waits until nobody uses the previous one. [setup]
    void set(Discipline* discipline, SlotTimes times = {});
    bool holds(const Discipline* discipline) const noexcept { return discipline_.load() == discipline; }  ///< [any]

private:
    std::atomic<Discipline*> discipline_{nullptr};  // written by set(), read by users
    std::atomic<unsigned> users_{0};
    mutable std::mutex times_mutex_;
    SlotTimes times_;  // of the discipline that is offered
};

/// Offers a discipline to the users of the line behind the port, in this process. Returns false when the line has one already. It must be
/// withdrawn before it is destroyed. [setup]
bool offer_discipline(const Port&, Discipline*, SlotTimes times = {});
/// Withdraws it from its line; waits until nobody uses it. [setup]
void withdraw_discipline(Discipline*);
/// Returns the handle to the discipline of the line behind the port, or nullptr when none is offered. [setup]
std::shared_ptr<DisciplineHandle> discipline_of(const Port&);

#pragma GCC visibility pop

}  // namespace hal::ethernet
