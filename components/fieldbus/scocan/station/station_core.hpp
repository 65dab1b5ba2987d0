// SPDX-License-Identifier: MIT
// What the parts of a node share: its table and role, the link, the clock of the cycle, the frames
// that wait, and the state. One thread uses all of them.
#pragma once

#include <cstdint>

#include "fieldbus/scocan/station/cycle_clock.hpp"
#include "fieldbus/scocan/station/send_queue.hpp"
#include "fieldbus/scocan/station/station_events.hpp"

namespace hal::scocan {

/// A slot of a cycle.
struct SlotIndex {
    std::uint64_t cycle = 0;
    std::uint32_t slot = no_slot;
    bool operator==(const SlotIndex&) const = default;
};

/// A moment in the grid of slots.
struct SlotTime {
    bool known = false;
    SlotIndex at;
    std::uint32_t counter = 0;  ///< of the cycle
    Time offset = 0;            ///< after the start of the slot
};

/// The shared part. [realtime]
struct StationCore {
    StationCore(const Table& slots, std::size_t number, const StationOptions& options,
                Events& receiver)
        : table(slots),
          node(static_cast<std::uint32_t>(number)),
          role(slots.nodes[number].role),
          backup(slots.nodes[number].backup),
          senses(slots.nodes[number].senses),
          single_shot(options.single_shot),
          events(receiver),
          crystal(options.crystal),
          clock(slots.cycle, slots.bits(4) + options.crystal.tick) {}

    const Table& table;
    const std::uint32_t node;
    const Role role;
    const std::uint32_t backup;
    const bool senses;
    const bool single_shot;
    Events& events;
    Crystal crystal;
    CycleClock clock;
    SendQueue queue;
    Count count;

    can::Link* link = nullptr;
    bool windows = false;  ///< of the link
    Time now = 0;          ///< of the link: in receive() and transmit()
    Time first_seen = INT64_MIN;  ///< first call, in this node's time
    Time last_begin = INT64_MIN;  ///< of the last frame on the bus
    State state = State::listening;
    bool silenced = false;
    bool listen_only = false;  ///< the table of the SYNC node differs
    bool leading = false;
    bool numbered = false;  ///< the counter is known
    std::uint32_t counter = 0;
    SlotIndex used;  ///< without windows: slot in which a frame was sent

    void raise(Event e, std::uint32_t who = no_node, std::uint32_t id = 0,
               Time value = 0) noexcept {
        events.on_event(e, who, id, value);
    }
    bool is_sync_node() const noexcept { return role == Role::sync || role == Role::backup; }
    /// Queues a frame of the configuration, for shared slots.
    void send_shared(const can::Frame& frame, bool state_frame) noexcept {
        queue.push(frame, no_slot, false, state_frame);
    }
    Time begin_of(const SlotIndex& at) const noexcept {
        return clock.at(at.cycle, table.slot() * at.slot);
    }
    std::uint32_t counter_of(std::uint64_t cycle) const noexcept {
        return static_cast<std::uint32_t>(counter + (cycle - clock.cycle())) % counter_cycles;
    }
    /// Returns the slot at a time of this node.
    SlotTime where(Time local) const noexcept;
    /// Hands a frame to the link; the window is in this node's time.
    bool send(const can::Frame&, can::Window) noexcept;
};

}  // namespace hal::scocan
