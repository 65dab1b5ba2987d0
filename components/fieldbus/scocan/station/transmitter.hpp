// SPDX-License-Identifier: MIT
// Sends the frames of a node in its private slots, in shared slots and in idle private slots of
// others. A link with transmit windows gets each frame ahead with its instant; on all others a
// frame is sent in the call that is within its window.
#pragma once

#include <array>

#include "fieldbus/scocan/station/slot_monitor.hpp"
#include "fieldbus/scocan/station/sync_sender.hpp"

namespace hal::scocan {

/// Sends what is queued in the slots of this node. [realtime]
class Transmitter {
public:
    /// All outlive it. [setup]
    Transmitter(StationCore& core, const ModeControl& modes, const SlotMonitor& monitor,
                SyncSender& sync) noexcept
        : core_(core), modes_(modes), slot_monitor_(monitor), sync_(sync) {}
    void attach() noexcept { not_allowed_.fill(false); }  ///< [setup]
    /// Forgets what goes to the bus.
    void forget() noexcept;
    /// Plans from the begin of the first cycle, of a node that makes a cycle of its own.
    void begin_cycles() noexcept { next_ = {0, 0}; }

    /// Queues a frame: see Station::send().
    can::Sent send(const can::Frame&, bool state, std::uint32_t slot) noexcept;
    /// Notes that a private slot was announced as idle: the rest of it is shared.
    void announced(const SlotIndex& at) noexcept { announced_ = at; }
    /// Sends what begins until the next call; `now` in this node's time.
    void transmit(Time now, Time period) noexcept;
    /// Notes the end of a call at a time of the link.
    void called(Time bus_now) noexcept { last_call_ = bus_now; }

private:
    struct Value {  // of a private message
        /// calls in which it was queued: the last one, the first one of a sequence
        Time last = INT64_MIN;
        Time since = 0;
    };
    /// The use of a slot in a cycle, as far as it is known.
    struct Slot {
        const Use* use = nullptr;  // nullptr: shared
        bool certain = true;  // false: it may be private in this cycle
        bool shared() const noexcept { return use == nullptr || use->kind == Kind::shared; }
    };

    can::Sent drop(can::Sent) noexcept;
    can::Sent not_allowed(std::uint32_t id, std::uint32_t sender) noexcept;
    bool may_send(std::uint64_t cycle) const noexcept;
    Slot slot_at(const SlotIndex&) const noexcept;
    bool is_own(const Slot& slot) const noexcept {
        return !slot.shared() && slot.use->node == core_.node;
    }
    void advance() noexcept;
    void resume_at(const SlotTime&, Time slack) noexcept;

    // with transmit windows
    void plan_ahead(Time now, Time period) noexcept;
    void plan(const SlotIndex&, Time begin) noexcept;
    bool plan_private(const Use&, std::uint32_t slot, Time begin) noexcept;
    void plan_idle(std::uint32_t slot, Time begin) noexcept;
    void plan_shared(Time begin, const can::Window&) noexcept;
    void recycle_announced(Time now) noexcept;
    // without
    void count_turns(Time now, Time period) noexcept;
    void count_missed_turn(const Use&, Time begin, Time period) noexcept;
    void start_now(Time now) noexcept;
    bool recycles(const SlotTime&, bool was_idle) const noexcept;
    void start(SendQueue::Entry&, const SlotTime&) noexcept;

    SendQueue::Entry* next_private(const Use&, std::uint32_t slot) noexcept;
    SendQueue::Entry* next_shared(Time offset) noexcept;
    SendQueue::Entry* repeated(const Use&, std::uint32_t slot) noexcept;

    StationCore& core_;
    const ModeControl& modes_;
    const SlotMonitor& slot_monitor_;
    SyncSender& sync_;
    SlotIndex next_{0, 0};  // to be planned
    SlotIndex announced_;  // of the current cycle
    Time last_call_ = INT64_MIN;  // of transmit(), on the clock of the link
    std::array<std::uint8_t, max_slots> last_index_{};  // by slot: identifier sent last
    std::array<Value, identifiers> values_{};
    std::array<bool, identifiers> not_allowed_{};  // by identifier: reported
};

}  // namespace hal::scocan
