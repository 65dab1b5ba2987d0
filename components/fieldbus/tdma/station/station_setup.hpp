// SPDX-License-Identifier: MIT
// What a station is told before it starts, and what is known of it afterwards. Plain data.
#pragma once

#include <cstdint>
#include <vector>

#include "fieldbus/tdma/wire/tdma_frames.hpp"

namespace hal::tdma {

enum class Role : std::uint8_t { master, backup, slave };

inline constexpr std::size_t most_slots = 16;    ///< of one station
inline constexpr unsigned    default_slot = 0;   ///< of real-time frames that name none
inline constexpr unsigned    tunnel_slot = 1;    ///< of ordinary packets; without it they use slot 0
inline constexpr unsigned    last_priority = 31;

struct SlotSetup {
    unsigned      id = 0;
    Time          offset = 0;   ///< from the sync
    std::uint32_t period = 1;   ///< used in each cycle with cycle % period == phasing
    std::uint32_t phasing = 0;  ///< 0 … period - 1
    std::uint32_t size = 60;    ///< bytes behind the Ethernet header of the longest frame; several shorter ones share its time
};

/// Another station of the segment, as far as this one knows.
struct Other {
    Address                mac{};  ///< zeros: not known
    Role                   role = Role::slave;
    std::vector<SlotSetup> slots{};
};

struct StationSetup {
    Role                   role = Role::slave;
    Time                   cycle = 1'000'000;
    Time                   backup_offset = 0;   ///< backup: from the sync that did not come to its own
    Time                   backup_from = 0;     ///< smallest backup offset of the segment: half as late, and it is a backup's; 0: the guard
    Time                   phase = 0;           ///< of the thread: its cycles begin that much after the sync
    Time                   lead = 0;            ///< between the beginning of the thread's cycle and its transmit at most
    Time                   guard = 10'000;      ///< a frame that would leave later than that after its time is dropped
    std::uint32_t          lost_limit = 4;      ///< cycles without a sync after which the station is silent and its outputs safe
    std::uint32_t          rounds = 100;        ///< of a calibration, at most 250
    std::uint32_t          listen_cycles = 3;   ///< of a master before it begins
    std::uint32_t          speed = 100;         ///< of the line, Mbit/s
    std::uint32_t          babble_limit = 0;    ///< frames of one station in a cycle that are too many; 0: 65
    std::size_t            queue = 32;          ///< frames that may wait for a slot
    std::size_t            room_for_slots = 0;  ///< as many may come by reconfigure()
    bool                   configured = true;   ///< false: it hears RTcfg only, until reconfigure()
    std::vector<SlotSetup> slots{};             ///< at most 16, with different ids
    std::vector<Address>   masters{};           ///< who may send syncs; empty: anybody
    std::vector<Other>     others{};            ///< all other stations; empty: not known
    bool                   asks_master = false; ///< pings() has one place more: of whoever sends the syncs
};

enum class State : std::uint8_t {
    listening,     ///< waits for a sync
    synchronising, ///< estimates the clock
    calibrating,   ///< measures the way to the master and back
    running,       ///< may use its slots
    withdrawn,     ///< a master that found another and has no followers; until that one is gone, or reset()
    unconfigured,  ///< it has no schedule yet: reconfigure()
};
const char* word(State) noexcept;

/// What happened, for a log and a safety chain.
enum class Event : std::uint8_t {
    synchronised,   ///< who: the master
    calibrated,     ///< value: ns to the master
    running,        ///<
    uncalibrated,   ///< no reply came for many requests; it is tried on. value: requests
    sync_lost,      ///< value: ns since the last
    leading,        ///< this station sends the syncs now
    yielded,        ///< and now it does not any more; who: the master
    other_master,   ///< a second master with a schedule of its own; who
    other_master_gone,  ///< its syncs ended; who
    withdrew,       ///< this master, which nobody follows, yields to it until it is gone; who
    stranger_sync,  ///< a sync of an address that the configuration does not allow, not acted on; who
    foreign_frame,  ///< somebody else sends in a slot of this station; who; value: the slot's id
    babbling,       ///< a station sends much more than it may; who; value: frames in a cycle
    master_changed, ///< who: the new one
    master_there,   ///< this master found another before it sent anything, and does not until that one is gone. who
    other_schedule,  ///< syncs come, but not in this station's cycle. who; value: ns from one to the next
    no_carrier,     ///< the port's line went away: a cable, a switch
    carrier,        ///< and is back
    unheard,        ///< no sync came since the station was switched on
    out_of_step,    ///< the sync is followed, but this thread does not come to it. who; value: ns it is off

    wrong_period,   ///< the thread's period is not the cycle: nothing is done. value: ns

    // of RTcfg
    unconfigured,        ///< it waits for its schedule
    other_server,        ///< a second server; not listened to. who
    other_configuration, ///< the server sends another schedule while this one is in use; not taken. who
    reported_dead,       ///< by the server. who: the station
    station_ready,       ///< a station has what this server gave it. who; value: the server's number of it
    station_dead,        ///< its heartbeat ended. who; value: the same
    station_too_long,    ///< what it is to be given does not fit in this server's slot 0. value: the same
};

/// [realtime] called by receive() and transmit()
class Events {
public:
    virtual ~Events() = default;
    virtual void on_event(Event, const Address& who, Time value) noexcept = 0;
};

struct Counters {
    std::uint64_t syncs = 0, syncs_lost = 0;   ///< received; cycles in which none came
    std::uint64_t syncs_sent = 0;
    std::uint64_t requests = 0, replies = 0, unanswered = 0;   ///< of this station's calibration
    std::uint64_t served = 0, too_late = 0;    ///< calibrations of others that were answered, and that could not be in time
    std::uint64_t foreign = 0;                 ///< frames of other versions and disciplines, cut ones, syncs of another schedule
    std::uint64_t intruders = 0;               ///< frames of others in slots of this station
    std::uint64_t sent = 0, dropped = 0;       ///< frames in slots; such that found no room or no time
    std::uint64_t late = 0;                    ///< slots that had passed before they could be used
    std::uint64_t losses = 0, take_overs = 0;
};

struct Status {
    State         state = State::listening;
    bool          synchronous = false;  ///< the sync is there, or was a few cycles ago
    bool          calibrated = false;
    bool          leading = false;      ///< this station sends the syncs
    bool          master_active = false;///< somebody does
    Address       master{};             ///< who sent the last one
    std::uint32_t cycle = 0;            ///< number of this cycle
    Time          global = 0;           ///< global time at the beginning of this thread's cycle
    Time          offset = 0;           ///< global - local
    double        drift = 0.0;          ///< of the local clock against the global one; 1e-6 is a ppm
    Time          delay = 0;            ///< to the master, one way
    double        jitter = 0.0;         ///< of syncs as they are received, rms, ns
    Time          error = 0;            ///< how much later this thread's cycle should have begun
    std::uint32_t silent_cycles = 0;    ///< since the last sync
    Counters      count;
};

}  // namespace hal::tdma
