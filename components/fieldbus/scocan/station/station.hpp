// SPDX-License-Identifier: MIT
// One node of a SCoCAN bus, without a thread: time slots on ordinary CAN. It follows the SYNC,
// sends in its private slots, in shared slots and in idle private slots of others; the SYNC node,
// its backups and the monitor are nodes with a further duty, by their role in the table.
//
//     Station node(table, *table.find("motor"), {}, sink);        // [setup]
//     node.attach(link);
//     ... each cycle of the thread:
//     node.receive(now);                                          // frames to the sink
//     node.send(frame, true);                                     // a value for its private slot
//     node.transmit(now, period);                                 // what begins until the next cycle of the thread
//
// A link with transmit windows (Description::has_windows) starts each frame itself at its instant;
// on all others a frame leaves in the cycle of the thread that is within its window, so that the
// thread must be faster than the slots.
#pragma once

#include <array>

#include "fieldbus/scocan/station/cycle_clock.hpp"
#include "fieldbus/scocan/station/send_queue.hpp"
#include "fieldbus/scocan/station/station_events.hpp"

namespace hal::scocan {

class Station {
public:
    /// Frames that a link in memory should hold: twice those that receive() takes at most. 20 nodes
    /// with more do not fit into a cache.
    static constexpr std::size_t receive_capacity = 512;

    /// The table and the sink outlive it. [setup]
    Station(const Table&, std::size_t node, const StationOptions&, Sink&);

    void attach(can::Link&) noexcept;  ///< [setup]
    void detach() noexcept { link_ = nullptr; }  ///< [setup]

    /// Starts anew after a time without cycles: the node listens first, as another one may send the
    /// SYNC now. Drops queued frames and those received meanwhile; a silenced node stays silenced.
    /// [realtime]
    void restart(Time now) noexcept;
    void receive(Time now) noexcept;  ///< [realtime]
    void transmit(Time now, Time period) noexcept;  ///< [realtime]
    /// Queues a frame: for a private slot of this node that carries its identifier, else for shared
    /// slots. `state`: a value, which replaces an older one that still waits. `slot`: a certain
    /// private slot. Returns rejected for an identifier that is reserved or of another node, and
    /// reports the first such frame of each identifier. [realtime]
    can::Sent send(const can::Frame&, bool state, std::uint32_t slot = no_slot) noexcept;
    /// Removes a waiting value. [realtime]
    void withdraw(std::uint32_t id) noexcept { queue_.withdraw(id); }
    /// Asks all nodes for a mode change. Only the node that sends the SYNC; returns false on all
    /// others. [realtime]
    bool change_mode(std::uint32_t mode) noexcept;
    /// Asks another node to send nothing, or to send again. Only the monitor; returns false on all
    /// others. [realtime]
    bool request_silence(std::uint32_t node, bool silent) noexcept;
    /// Ends silence after an offence, and standby behind a second SYNC node. [realtime]
    void reset() noexcept;

    const Table& table() const noexcept { return table_; }
    std::size_t node() const noexcept { return node_; }
    State state() const noexcept { return state_; }
    const Count& count() const noexcept { return count_; }
    const CycleClock& clock() const noexcept { return clock_; }
    std::uint32_t counter() const noexcept { return counter_; }
    std::uint32_t mode() const noexcept { return mode_; }
    bool leading() const noexcept { return leading_; }
    bool monitored() const noexcept { return monitored_; }
    bool changing() const noexcept { return change_.active; }
    std::uint32_t lost() const noexcept { return clock_.lost(); }
    std::size_t waiting() const noexcept { return queue_.size(); }
    std::uint32_t foreign_of(std::uint32_t id) const noexcept { return foreign_[id & 0x7ff]; }
    /// Returns the begin of a slot of the current cycle, on the clock of the link. [realtime]
    Time slot_start(std::uint32_t slot) const noexcept {
        return crystal_.bus(clock_.at(clock_.cycle(), table_.slot() * slot));
    }
    bool has_windows() const noexcept { return windows_; }

private:
    struct Where {
        bool known = false;
        std::uint64_t cycle = 0;
        std::uint32_t slot = 0;
        std::uint32_t counter = 0;
        Time offset = 0;  ///< behind the begin of the slot
    };
    struct Change {  // asked by the node that sends the SYNC
        bool active = false;
        bool agreed = false;
        std::uint32_t mode = 0;
        std::uint64_t at = 0;  ///< cycle of the switch
        std::array<bool, most_nodes> ready{};
    };
    struct Armed {  // prepared in every node
        bool prepared = false;
        bool confirmed = false;
        std::uint32_t mode = 0;
        std::uint64_t at = 0;  ///< cycle of the switch
    };
    struct Value {  // of a private message
        /// calls in which it was queued: the last one, the first one of a sequence
        Time last = INT64_MIN;
        Time since = 0;
    };

    // station_receive.cpp
    void forget() noexcept;
    void arrived(const can::Frame&) noexcept;
    void sync(const can::Frame&, Time begin) noexcept;
    void begin_cycles() noexcept;
    void echo(const can::Frame&, const Where&, Time begin) noexcept;
    Where where(Time local) const noexcept;
    void judge(Time now) noexcept;
    void raise(Event e, std::uint32_t who = no_node, std::uint32_t id = 0,
               Time value = 0) noexcept {
        sink_.on_event(e, who, id, value);
    }
    // station_watch.cpp
    bool is_foreign(const can::Frame&, const Where&) const noexcept;
    void watch(const can::Frame&, const Where&, Time begin) noexcept;
    void offend(Time begin) noexcept;
    void close_cycle() noexcept;
    std::uint32_t owner_of(std::uint32_t id) const noexcept;
    // station_transmit.cpp
    can::Sent not_allowed(std::uint32_t id, std::uint32_t sender) noexcept;
    bool may_send(std::uint64_t cycle) const noexcept;
    void plan_ahead(Time now, Time period) noexcept;
    void plan(std::uint64_t cycle, std::uint32_t slot, Time begin) noexcept;
    void plan_shared(Time begin, const can::Window&) noexcept;
    void recycle_announced(Time now) noexcept;
    void start_now(Time now) noexcept;
    SendQueue::Entry* next_private(const Use&, std::uint32_t slot) noexcept;
    SendQueue::Entry* repeated(const Use&, std::uint32_t slot) noexcept;
    void count_turns(Time now, Time period) noexcept;
    bool emit(const can::Frame&, can::Window) noexcept;
    Time begin_of(std::uint64_t cycle, std::uint32_t slot) const noexcept {
        return clock_.at(cycle, table_.slot() * slot);
    }
    std::uint32_t counter_of(std::uint64_t cycle) const noexcept {
        return static_cast<std::uint32_t>(counter_ + (cycle - clock_.cycle())) % counter_cycles;
    }
    std::uint32_t mode_of(std::uint64_t cycle) const noexcept;
    // station_sync.cpp
    bool is_sync_node() const noexcept { return role_ == Role::sync || role_ == Role::backup; }
    void lead(Time now) noexcept;
    can::Frame sync_frame(std::uint64_t cycle) const noexcept;
    void set_leading(bool) noexcept;
    void plan_sync(std::uint64_t cycle) noexcept;
    bool takes_over(std::uint64_t cycle) noexcept;
    void other_sync(const Sync&) noexcept;
    void sync_sent(Time begin) noexcept;
    void announce_table() noexcept;
    // station_modes.cpp
    void configuration(const can::Frame&) noexcept;
    void silence_requested(const Request&) noexcept;
    void requested(const Request&) noexcept;
    void answered(const Answer&) noexcept;
    void change_cycle() noexcept;
    void refuse(std::uint32_t who, Answer::Reason) noexcept;
    void switch_mode() noexcept;

    const Table& table_;
    const std::size_t node_;
    const Role role_;
    const std::uint32_t backup_;
    const bool senses_, single_shot_, wants_windows_;
    Sink& sink_;
    Crystal crystal_;
    CycleClock clock_;
    SendQueue queue_;
    Count count_;

    can::Link* link_ = nullptr;
    bool windows_ = false;  ///< of the link
    bool timed_ = false;  ///< frames take the time of their bits
    State state_ = State::listening;
    bool silenced_ = false;
    bool listen_only_ = false;
    bool mode_unknown_ = false;
    bool was_down_ = false;

    bool was_silent_ = false;

    bool numbered_ = false;  ///< the counter is known
    std::uint32_t counter_ = 0;
    std::uint32_t mode_ = 0;
    Armed armed_;
    Change change_;

    std::uint64_t next_cycle_ = 0;  ///< next slot to be planned
    std::uint32_t next_slot_ = 0;
    std::uint64_t used_cycle_ = 0;  ///< without windows: slot in which a frame was sent
    std::uint32_t used_slot_ = no_slot;
    Time last_begin_ = INT64_MIN;  ///< of the last frame on the bus
    std::uint32_t announced_slot_ = no_slot;  ///< of the current cycle
    std::uint64_t announced_cycle_ = 0;

    bool leading_ = false;
    bool standby_ = false;  ///< standby: another primary sends
    /// of the link: in receive() and transmit(), and of the last transmit()
    Time now_ = 0;
    Time last_call_ = INT64_MIN;
    Time first_seen_ = INT64_MIN;  ///< first call
    std::uint32_t leader_ = no_node;  ///< sender field of the last SYNC

    std::array<can::Frame, 16> frames_;  ///< within receive()
    std::array<std::uint8_t, most_slots> last_index_{};  ///< by slot: identifier sent last
    std::array<std::uint32_t, 2048> foreign_{};
    std::array<Value, identifiers> values_{};
    std::array<bool, identifiers> not_allowed_{};  ///< by identifier: reported
    /// slots of this cycle with a frame, with an announcement
    std::array<bool, most_slots> seen_{}, told_{};
    std::uint32_t foreign_in_cycle_ = 0;
    std::uint32_t foreign_id_ = 0;
    std::uint32_t unannounced_cycles_ = 0;
    std::uint32_t offences_ = 0;

    std::uint32_t off_rate_ = 0;  ///< off_rate_: SYNC intervals in a row that no clock explains
    Time first_offence_ = 0;
    bool monitored_ = false;
    bool monitor_lost_ = false;
    bool babbled_ = false;
};

}  // namespace hal::scocan
