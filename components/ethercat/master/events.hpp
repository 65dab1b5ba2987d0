// SPDX-License-Identifier: MIT
// What happens on the bus, in numbers: the cycle must not form sentences, a reporter outside does.
#pragma once

#include <cstdint>

namespace hal::ethercat::master {

/// In brackets the two numbers. `slave` is an index in Setup::slaves, or of_position + position
/// where the setup does not name the slave.
enum class Event : std::uint8_t {
    link_lost,
    link_restored,      ///< primary or backup port [port 0 or 1, -]
    no_slaves,                     ///< nothing answers
    scanned,                       ///< [slaves found, slaves expected]
    too_many_slaves,               ///< [found, capacity]
    slave_missing,                 ///< not on the bus at start [position, -]
    unknown_slave,                 ///< not in the setup [vendor, product]
    unknown_gone,                  ///< no slave is unknown any more [-, -]
    wrong_vendor,
    wrong_product,
    wrong_revision,
    wrong_serial,  ///< [found, expected]
    /// alias or device identification [number, position of the second]
    duplicate_alias,
    /// EEPROM not readable, or 7: its checksum is wrong [0502h, word]
    sii_failed,
    /// start-up writes for a slave without mailbox [index << 8 | sub, -]
    no_mailbox,
    too_few_fmmus,
    too_few_sync_managers,  ///< [present, needed]
    state_reached,                 ///< [State, -]
    state_refused,                 ///< [State requested, AL status code]
    state_timeout,                 ///< [State requested, AL status]
    fell_back,                     ///< left its state by itself [AL status, AL status code]
    startup_write_failed,          ///< [index << 8 | sub, event_code()]
    no_eoe,  ///< configured, but the slave has no EoE [MailboxProtocols, -]
    eoe_failed,  ///< rejects its IP settings [eoe::Result; 0: no answer, -]
    mapping_failed,  ///< [value << 24 | index << 8 | sub, event_code()]
    /// read back other than written [value << 24 | index << 8 | sub, value read]
    mapping_differs,
    too_many_entries,  ///< [PDO, entries]
    /// no mailbox to change the mapping [sync manager << 16 | bytes of the setup, bytes of the
    /// slave]
    fixed_size,
    slave_lost,
    slave_returned,  ///< [position, -]
    slave_operational,  ///< [position, ms since its start-up began]
    wkc_incomplete,
    wkc_complete,  ///< of a domain [domain << 16 | counter, expected]
    reference_clock,  ///< `slave` leads [64 bit: 1, -]
    dc_unsupported,  ///< configured, but the slave has no clock
    /// clock not within the window in time [deviation ns, window ns]
    dc_timeout,
    /// clock not within the window in time, but near enough to start [deviation ns, window ns]
    dc_tolerated,
    dc_not_set,  ///< the time of its clock could not be set [ms waited, -]
    /// clock far beyond the window while operational [deviation ns, window ns]
    dc_lost,
    /// as dc_lost, by the largest deviation that the register holds [deviation ns, window ns]
    dc_far,
    /// clock in the window again after dc_lost or dc_far [deviation ns, ms it was beyond it]
    dc_recovered,
    /// the reference clock of `slave` has jumped, so that others are beyond the window [jump ns,
    /// window ns]
    dc_jumped,
    /// the clocks are in the window again after dc_jumped [largest deviation ns, ms]
    dc_jump_ended,
    dc_synchronised,  ///< all slaves [largest deviation ns, -]
    ring_broken,
    /// `slave` is the one before the break [position, responding to the primary port]
    ring_closed,
    topology_changed,  ///< [slaves before, slaves now]
    /// EtherCAT frames that are not ours [frames in the last second, -]
    other_master,
    /// received at a port, damaged on the cable there [port | neighbour << 8, frames]
    damaged_frames,
    /// of CoE, from the slave itself [code | error register << 16, its 5 bytes, the first lowest]
    emergency,
    /// gives up for now and starts again later [State it was in, seconds to the next try]
    start_up_failed,
    /// in the state below OP that the setup names for it [State, ms since its start-up began]
    slave_settled,
    /// in OP, but its process data is not exchanged [Staleness, -]
    data_stale,
    data_fresh,  ///< its process data is exchanged again [position, -]
};

/// Why the process data of a slave is not exchanged.
enum class Staleness : std::uint8_t {
    lost,  ///< the frames do not return
    late,  ///< the frames return after their timeout
    counter,  ///< the frames return with a working counter that is too small
};

/// Set in the second number of an event if its low half is the code of a mailbox error and not of
/// an abort.
inline constexpr std::int64_t mailbox_error_flag = std::int64_t{1} << 32;

/// Receives events. [realtime] in the thread of the master's cycle
class Events {
public:
    static constexpr std::uint32_t bus = 0xffff'ffff;  ///< `slave` of an event of the whole bus
    static constexpr std::uint32_t of_position = 0x1'0000;  ///< see Event
    static constexpr std::uint32_t nothing =
        0xffff'fffe;  ///< neighbour of Event::damaged_frames: the port is open
    virtual ~Events() = default;
    virtual void on_event(Event event, std::uint32_t slave, std::int64_t first,
                          std::int64_t second) noexcept = 0;
};

}  // namespace hal::ethercat::master
