// SPDX-License-Identifier: MIT
// What a station reports, and its state.
#pragma once

#include <cstdint>

#include "fieldbus/scocan/station/crystal.hpp"
#include "fieldbus/scocan/wire/wire.hpp"

namespace hal::scocan {

enum class State : std::uint8_t {
    listening,    ///< no SYNC yet
    running,      ///< sends in its slots
    silent,       ///< too many SYNCs lost: receives only
    listen_only,  ///< another table or an unknown mode: receives only
    /// sent outside of its slots, or was silenced by the monitor: sends nothing until reset
    silenced,
    down,         ///< the controller is off the bus, or the interface is down
};
const char* to_string(State) noexcept;

/// `who` is a node, or no_node; `id` the identifier it is about.
enum class Event : std::uint8_t {
    running,         ///< synchronised: the slots may be used
    sync_lost,       ///< value: SYNCs lost; the node stops sending
    sync_late,       ///< value: ns after (or before) its time; ignored
    sync_doubled,    ///< a second SYNC in one cycle; ignored
    /// value: ppm of the SYNC's interval against the cycle; ignored: the node does not synchronise
    sync_off_rate,
    sync_jumped,  ///< a new phase: adopted
    other_sync,  ///< who: a second SYNC node sends; this one is on standby
    leading,  ///< this node sends the SYNC
    standby,  ///< this node does not send the SYNC any more
    other_table,  ///< value: CRC of the SYNC sender; receives only
    table_agrees,  ///< the CRCs agree again
    unknown_mode,  ///< value: mode of the SYNC; receives only
    foreign_frame,  ///< id, who: its owner by the table; value: slot in which it was
    babbling,  ///< id, who; value: frames outside of their slots in one cycle
    /// id; value: period of the thread, ns: no cycle of it was within the transmit window
    slot_missed,
    late_frame,  ///< own frame; value: ns after the end of its transmit window
    silenced,  ///< this node
    silenced_by_monitor,  ///< this node, by the monitor
    bus_off,
    bus_on,
    mode_changed,  ///< value: mode
    mode_refused,  ///< who, value: reason (Answer::Reason); id: mode
    monitor_lost,  ///< idle slots are not announced any more
    monitor_found,
    frame_too_long,  ///< id; value: bytes: does not fit into any slot
    /// id, who: its owner by the table, or no_node for a reserved one: not sent; once for each
    /// identifier
    not_allowed,
};
inline constexpr std::uint32_t no_node = UINT32_MAX;

struct Count {
    std::uint64_t syncs = 0;
    std::uint64_t syncs_lost = 0;
    std::uint64_t syncs_ignored = 0;
    std::uint64_t losses = 0;
    std::uint64_t sent_private = 0;
    std::uint64_t sent_shared = 0;
    std::uint64_t sent_recycled = 0;
    std::uint64_t missed = 0;  ///< private slots in which the frame could not be sent
    std::uint64_t foreign = 0;
    std::uint64_t late = 0;
    std::uint64_t received = 0;
    std::uint64_t dropped = 0;
    std::uint64_t idle = 0;
    std::uint64_t announced = 0;
    std::uint64_t mode_changes = 0;
};

/// Receives frames of the application and events. [realtime]
class Events {
public:
    virtual ~Events() = default;
    /// `begin_ns`: start of frame, on the clock of the link.
    virtual void on_frame(const can::Frame&, Time begin_ns) noexcept = 0;
    virtual void on_sent(const can::Frame&, Time /*begin_ns*/) noexcept {}
    virtual void on_event(Event, std::uint32_t who, std::uint32_t id, Time value) noexcept = 0;
};

struct StationOptions {
    /// false: a controller that repeats disturbed frames in private slots
    bool single_shot = true;
    bool windows = true;  ///< use the transmit windows of the controller, where it has them
    Crystal crystal{};  ///< of a simulated node
};

}  // namespace hal::scocan
