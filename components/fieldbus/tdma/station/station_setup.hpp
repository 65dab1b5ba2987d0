// SPDX-License-Identifier: MIT
// The set-up of a station, and its state. Plain data. All times are ns.
#pragma once

#include <cstdint>
#include <vector>

#include "fieldbus/tdma/wire/tdma_frames.hpp"

namespace hal::tdma {

/// What a station does for the segment (RTnet, Documentation/TDMA).
enum class Role : std::uint8_t { master, backup, slave };

inline constexpr std::size_t max_slots = 16;    ///< of one station
inline constexpr unsigned default_slot = 0;   ///< of real-time frames that name none
/// of ordinary packets; without it they use slot 0
inline constexpr unsigned tunnel_slot = 1;
inline constexpr unsigned last_priority = 31;

/// A slot of the station.
struct SlotSetup {
    unsigned id = 0;
    Time offset = 0;   ///< from the sync
    std::uint32_t period = 1;   ///< used in each cycle with cycle % period == phasing
    std::uint32_t phasing = 0;  ///< 0 … period - 1
    /// payload bytes of the longest frame; several shorter ones share its time
    std::uint32_t size = 60;
};

/// Another station of the segment.
struct Other {
    Address mac{};  ///< zeros: unknown
    Role role = Role::slave;
    std::vector<SlotSetup> slots{};
    std::uint16_t index = 0;  ///< of its block in the schedule
};

/// The station's part of the schedule.
struct StationSetup {
    Role role = Role::slave;
    Time cycle = 1'000'000;
    Time backup_offset = 0;   ///< backup: from the missing sync to its own
    /// smallest backup offset: a sync later than half of it is a backup's; 0: use guard
    Time backup_from = 0;
    Time phase = 0;           ///< beginning of the thread's cycle after the sync
    /// longest time from the beginning of the thread's cycle to transmit()
    Time lead = 0;
    /// a frame that would leave later than this is dropped
    Time guard = 10'000;
    /// cycles without a sync until the station stops sending
    std::uint32_t lost_limit = 4;
    std::uint32_t rounds = 100;        ///< of a calibration, 1..250
    std::uint32_t listen_cycles = 3;   ///< cycles that a master listens before it sends
    std::uint32_t speed = 100;         ///< line speed, Mbit/s
    /// frames of one station per cycle that are babbling; 0: 65
    std::uint32_t babble_limit = 0;
    std::size_t queue = 32;          ///< capacity of the queue of a slot
    std::size_t slot_capacity = 0;   ///< largest number of slots for reconfigure()
    bool configured = true;   ///< false: receives RTcfg only, until reconfigure()
    std::vector<SlotSetup> slots{};             ///< at most 16, with unique ids
    std::vector<Address> masters{};           ///< stations that may send syncs; empty: all
    std::vector<Other> others{};            ///< all other stations; empty: unknown
    bool asks_master = false; ///< pings() has one more entry, for the master
};

/// State of a station, in the order of its start.
enum class State : std::uint8_t {
    listening,     ///< waits for a sync
    synchronising, ///< estimates the clock
    calibrating,   ///< measures the path delay to the master
    running,       ///< may use its slots
    withdrawn,     ///< a master that stepped down, until the other one is lost, or reset()
    unconfigured,  ///< no schedule yet, see reconfigure()
};
/// Returns the name of the state. [any]
const char* to_string(State) noexcept;

/// Events of a station, for a log and a safety chain. `who` and `value` are arguments of
/// Events::on_event().
enum class Event : std::uint8_t {
    synchronised,   ///< who: the master
    calibrated,     ///< value: ns to the master
    running,        ///< the slots may be used
    uncalibrated,   ///< many requests without a reply; retrying. value: requests
    sync_lost,      ///< who: the master; value: ns since the last sync
    new_schedule,   ///< the master sends the syncs of another schedule now; who
    leading,        ///< this station sends the syncs now
    yielded,        ///< this station stops sending syncs; who: the master
    other_master,   ///< a second master with a schedule of its own; who
    other_master_gone,  ///< the second master is lost; who
    withdrew,       ///< this master without followers stepped down for another; who
    unknown_master, ///< ignored a sync from an address that the schedule does not allow; who
    foreign_frame,  ///< another station sends in a slot of this one; who; value: slot id
    /// two stations send in the slots of one block; who: the second; value: the first, and the
    /// block: see duplicate_value()
    duplicate_slot,
    babbling,       ///< a station floods the segment; who; value: frames in a cycle
    master_changed, ///< who: the new one
    master_there,  ///< this master found another at its start, and waits until that is lost; who
    other_schedule,  ///< the syncs have another cycle; who; value: their cycle, ns
    no_carrier,  ///< the port lost its carrier: a cable, a switch
    carrier,  ///< the carrier is back
    unheard,  ///< no sync received since the start
    /// the thread does not come into phase with the sync; who; value: phase error, ns
    out_of_step,

    wrong_period,  ///< the thread's period is not the cycle; nothing is sent. value: ns

    // of RTcfg
    unconfigured,  ///< waits for its schedule
    other_server,  ///< ignored a second server; who
    other_configuration,  ///< ignored another schedule while one is in use; who
    reported_dead,  ///< the server reports a dead station; who
    station_ready,  ///< a client is configured; who; value: its index in the schedule
    station_dead,  ///< no heartbeat of a client; who; value: its index
    /// its configuration does not fit into slot 0 of this server; value: its index
    station_too_long,
};

/// The value of Event::duplicate_slot: the address of the first station, and the index of the block
/// in the schedule. [any]
inline Time duplicate_value(const Address& first, std::uint16_t index) noexcept {
    std::uint64_t value = index;
    for (const std::uint8_t byte : first) {
        value = value << 8 | byte;
    }
    return static_cast<Time>(value);
}
inline std::uint16_t duplicate_index(Time value) noexcept {
    return static_cast<std::uint16_t>(static_cast<std::uint64_t>(value) >> 48);
}
inline Address duplicate_address(Time value) noexcept {
    Address first{};
    for (std::size_t n = first.size(); n-- > 0; value >>= 8) {
        first[n] = static_cast<std::uint8_t>(value & 0xff);
    }
    return first;
}

/// Receives the events of a station, from receive() and transmit(). [realtime]
class Events {
public:
    virtual ~Events() = default;
    virtual void on_event(Event, const Address& who, Time value) noexcept = 0;
};

/// Counters since attach().
struct Counters {
    std::uint64_t syncs = 0;
    std::uint64_t syncs_lost = 0;  ///< received; cycles without one
    std::uint64_t syncs_sent = 0;
    std::uint64_t requests = 0;
    std::uint64_t replies = 0;
    std::uint64_t unanswered = 0;  ///< of this station's calibration
    /// calibration requests answered; too late to answer
    std::uint64_t served = 0;
    std::uint64_t too_late = 0;
    /// truncated frames, other versions and disciplines, syncs of another schedule
    std::uint64_t foreign = 0;
    std::uint64_t intruders = 0;  ///< frames of others in slots of this station
    std::uint64_t sent = 0;  ///< frames sent in slots
    std::uint64_t cleared = 0;  ///< frames that were queued when the station stopped sending
    std::uint64_t losses = 0;
    std::uint64_t take_overs = 0;
};

/// The state of a station after receive().
struct Status {
    State state = State::listening;
    bool synchronous = false;  ///< a sync was received within lost_limit cycles
    bool calibrated = false;
    bool leading = false;  ///< this station sends the syncs
    bool master_active = false;  ///< a master sends syncs
    Address master{};  ///< sender of the last sync
    std::uint32_t cycle = 0;  ///< number of this cycle
    Time global = 0;  ///< global time at the beginning of this thread's cycle
    Time offset = 0;  ///< global - local
    /// of the local clock against the global one; 1e-6 is 1 ppm
    double drift = 0.0;
    Time delay = 0;  ///< path delay to the master, one way
    double jitter = 0.0;  ///< of received syncs, rms, ns
    Time error = 0;  ///< how much later this thread's cycle should have begun
    std::uint32_t silent_cycles = 0;  ///< cycles since the last sync
    Counters count;
};

}  // namespace hal::tdma
