// SPDX-License-Identifier: MIT
// One node of a SCoCAN bus, without a thread: time slots on ordinary CAN. It follows the SYNC,
// sends in its private slots, in shared slots and in idle private slots of others; the SYNC node,
// its backups and the monitor are nodes with a further duty, by their role in the table.
//
//     Station node(table, *table.find("motor"), {}, events);        // [setup]
//     node.attach(link);
//     ... each cycle of the thread:
//     node.receive(now);                                          // frames and events, to `events`
//     node.send(frame, true);                                     // a value for its private slot
//     node.transmit(now, period);                                 // what begins until the next cycle of the thread
//
// A link with transmit windows (Description::has_windows) starts each frame itself at its instant;
// on all others a frame leaves in the cycle of the thread that is within its window, so that the
// thread must be faster than the slots.
#pragma once

#include <array>

#include "fieldbus/scocan/station/transmitter.hpp"

namespace hal::scocan {

class Station {
public:
    /// Frames that a link in memory should hold: twice those that receive() handles at most. 20
    /// nodes with more do not fit into a cache.
    static constexpr std::size_t receive_capacity = 512;

    /// The table and the events outlive it. [setup]
    Station(const Table&, std::size_t node, const StationOptions&, Events&);

    void attach(can::Link&) noexcept;  ///< [setup]
    void detach() noexcept { core_.link = nullptr; }  ///< [setup]

    /// Starts anew after a time without cycles: the node listens first, as another one may send the
    /// SYNC now. Drops and counts queued frames, and drops those received meanwhile; a silenced
    /// node stays silenced. [realtime]
    void restart(Time now) noexcept;
    void receive(Time now) noexcept;  ///< [realtime]
    void transmit(Time now, Time period) noexcept;  ///< [realtime]
    /// Queues a frame: for a private slot of this node that carries its identifier, else for shared
    /// slots. `state`: a value, which replaces an older one that still waits. `slot`: a certain
    /// private slot. Returns rejected for an identifier that is reserved or of another node, and
    /// reports the first such frame of each identifier. [realtime]
    can::Sent send(const can::Frame& frame, bool state, std::uint32_t slot = no_slot) noexcept {
        return transmitter_.send(frame, state, slot);
    }
    /// Removes a waiting value. [realtime]
    void withdraw(std::uint32_t id) noexcept { core_.queue.withdraw(id); }
    /// Asks all nodes for a mode change. Only the node that sends the SYNC; returns false on all
    /// others. [realtime]
    bool change_mode(std::uint32_t mode) noexcept { return modes_.request(mode); }
    /// Asks another node to send nothing, or to send again. Only the monitor; returns false on all
    /// others. [realtime]
    bool request_silence(std::uint32_t node, bool silent) noexcept;
    /// Ends silence after an offence, and standby behind a second SYNC node. [realtime]
    void reset() noexcept;

    const Table& table() const noexcept { return core_.table; }
    std::size_t node() const noexcept { return core_.node; }
    State state() const noexcept { return core_.state; }
    const Count& count() const noexcept { return core_.count; }
    const CycleClock& clock() const noexcept { return core_.clock; }
    std::uint32_t counter() const noexcept { return core_.counter; }
    std::uint32_t mode() const noexcept { return modes_.mode(); }
    bool leading() const noexcept { return core_.leading; }
    bool monitored() const noexcept { return slot_monitor_.monitored(); }
    bool changing() const noexcept { return modes_.changing(); }
    std::uint32_t lost() const noexcept { return core_.clock.lost(); }
    std::size_t waiting() const noexcept { return core_.queue.size(); }
    /// Returns true when send() would drop a frame that replaces no value. [realtime]
    bool is_full() const noexcept { return core_.queue.size() == SendQueue::capacity; }
    std::uint32_t foreign_of(std::uint32_t id) const noexcept {
        return slot_monitor_.foreign_of(id);
    }
    /// Returns the begin of a slot of the current cycle, on the clock of the link. [realtime]
    Time slot_start(std::uint32_t slot) const noexcept {
        return core_.crystal.bus(core_.begin_of({core_.clock.cycle(), slot}));
    }
    bool has_windows() const noexcept { return core_.windows; }

private:
    void forget() noexcept;
    void confirm_old_echo(const can::Frame&) noexcept;
    void accept(const can::Frame&) noexcept;
    void accept_sync(const can::Frame&, Time begin) noexcept;
    bool synchronises(Time stamp, bool led) noexcept;
    void accept_echo(const can::Frame&, const SlotTime&, Time bus_begin) noexcept;
    void accept_announcement(std::uint32_t slot, const SlotTime&) noexcept;
    void accept_configuration(const can::Frame&) noexcept;
    void accept_request(const Request&) noexcept;
    void silence(const Request&) noexcept;
    void compare_tables(const Request&) noexcept;
    void watch_controller() noexcept;
    bool is_silent(Time now) const noexcept;
    State next_state(bool silent) const noexcept;
    void update_state(Time now) noexcept;

    StationCore core_;
    ModeControl modes_{core_};
    SlotMonitor slot_monitor_{core_, modes_};
    SyncSender sync_{core_, modes_};
    Transmitter transmitter_{core_, modes_, slot_monitor_, sync_};
    const bool wants_windows_;
    bool timed_ = false;  // frames take the time of their bits
    bool was_down_ = false;
    bool was_silent_ = false;
    std::uint32_t off_rate_ = 0;  // SYNC intervals in a row that no clock explains
    std::array<can::Frame, 16> frames_;  // within receive()
};

}  // namespace hal::scocan
