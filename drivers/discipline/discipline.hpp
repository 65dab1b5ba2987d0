// SPDX-License-Identifier: MIT
// The seam between a discipline, which decides when frames may leave on an Ethernet segment (TDMA),
// and the other users of that segment, which pass their frames to it. The component that runs a
// discipline offers it for its port; a link that opens a port on the same line obtains a handle:
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
    /// Queues a frame for slot `slot` (RTnet's slot ID; 0 is the default one), `priority` 0
    /// (highest) to 31. It leaves in the slot's next turn. On `full` that turn is taken by frames
    /// of the same or a higher priority, and the caller keeps the frame. `finisher` is that of
    /// Launch. [any, realtime]
    virtual Sent send(std::span<const std::uint8_t> frame, unsigned slot, unsigned priority,
                      Finisher* finisher = nullptr) noexcept = 0;
    /// Counts a frame that its sender has dropped before send(): the line is down, or no frame of
    /// the slot is long enough. [any, realtime]
    virtual void count_dropped() noexcept {}
    /// Returns the payload bytes that a frame in this slot may have; 0: no such slot. [any]
    virtual std::size_t capacity(unsigned slot) const noexcept = 0;
    /// Returns true when the station may send: synchronised and calibrated. [any]
    virtual bool ready() const noexcept = 0;
    /// Returns the address of the station. [any]
    virtual const Address& address() const noexcept = 0;

    /// Whether the station could have sent a frame that arrived at that time.
    enum class Origin : std::uint8_t {
        plausible,
        unknown_station,  ///< an address that is not in the configuration
        out_of_slot,  ///< not in a slot of that station
    };
    /// Checks a received frame of `length` bytes; its slot only in the thread of the discipline.
    /// [any, realtime]
    virtual Origin origin(const Address& /*from*/, std::int64_t /*arrived_ns*/,
                          std::size_t /*length*/) const noexcept {
        return Origin::plausible;
    }
};

/// The delivery times through each slot, where the schedule is known in advance.
using SlotTimes = std::map<unsigned, std::vector<can::DeliveryTime>>;

/// Access of a user to the discipline of a line. The discipline may be withdrawn, and another one
/// offered, at any time.
class DisciplineHandle {
public:
    /// Calls `use` with the discipline, which stays until that returns. Returns false, without a
    /// call, when none is offered. [realtime]
    template <class Use>
    bool with(Use use) noexcept {
        users_.fetch_add(1);
        Discipline* const now = discipline_.load();
        if (now != nullptr) {
            use(*now);
        }
        users_.fetch_sub(1);
        return now != nullptr;
    }
    /// Returns the delivery times through a slot; empty: unknown. [setup]
    std::vector<can::DeliveryTime> delivery_times(unsigned slot) const;
    /// Replaces the discipline; nullptr withdraws it. Waits until the previous one is unused.
    /// [setup]
    void set(Discipline* discipline, SlotTimes times = {});
    /// Returns true when it is the current one. [any]
    bool holds(const Discipline* discipline) const noexcept {
        return discipline_.load() == discipline;
    }

private:
    std::atomic<Discipline*> discipline_{nullptr};  // written by set(), read by users
    std::atomic<unsigned> users_{0};
    mutable std::mutex times_mutex_;
    SlotTimes times_;  // of the discipline that is offered
};

/// Offers a discipline to the users of the line behind the port, in this process. Returns false
/// when the line already has one. Withdraw it before destroying it. [setup]
bool offer_discipline(const Port&, Discipline*, SlotTimes times = {});
/// Withdraws a discipline from its line; waits until it is unused. [setup]
void withdraw_discipline(Discipline*);
/// Returns the handle to the discipline of the line behind the port, or nullptr when none is
/// offered. [setup]
std::shared_ptr<DisciplineHandle> discipline_of(const Port&);

#pragma GCC visibility pop

}  // namespace hal::ethernet
