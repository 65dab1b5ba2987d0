// SPDX-License-Identifier: MIT
// The bus as the tasks of the master share it: slaves, frames, status. Not for users of the master;
// they see master.hpp.
//
// One task works for the whole bus (supervise): it scans, starts the start-up of each slave on the
// channel of that slave, and then watches. Another one reads error counters and clock deviations in
// turn. All of them run in the thread of the cycle.
#pragma once

#include <atomic>
#include <bitset>
#include <memory>
#include <optional>
#include <vector>

#include "ethercat/master/bus_slave.hpp"
#include "ethercat/master/channel.hpp"
#include "ethercat/master/coe_access.hpp"
#include "ethercat/master/events.hpp"
#include "ethercat/master/process_image.hpp"
#include "ethercat/master/status.hpp"
#include "ethercat/master/wire_engine.hpp"
#include "ethercat/wire/registers.hpp"

namespace hal::ethercat::master {

inline constexpr std::uint16_t first_station = 0x1001;
inline constexpr std::int64_t millisecond = 1'000'000;
inline constexpr std::int64_t tolerable_deviation_ns = 10'000;

/// A place for a slave on the bus.
struct Device {
    BusSlave slave;
    SlaveStatus status;
    Channel channel;
    bool identified = false;  ///< the registers and the SII were read
    bool refused = false;  ///< is not the slave that the setup names; stays in INIT
    bool times_read = false;  ///< its receive times are those of the newest latch
    bool clock_set = false;  ///< offset and delay are written
    bool synchronised = false;  ///< its clock was within the window
    bool drifted = false;  ///< it was reported as not in step, while it is operational
    std::int64_t drifts_since_ns = 0;  ///< when its clock left the window; 0: it is there
    bool follows_jump = false;  ///< it left the window because the reference clock jumped
    bool settled = false;  ///< a start-up brought it to the state that the setup names
    bool in_op = false;  ///< settled in OP
    bool stale = false;  ///< its process data is not exchanged
    bool stale_reported = false;
    /// it is to be in BOOT, for its firmware; only a slave that the setup does not name
    bool to_boot = false;
    bool helping = false;  ///< the task on its channel works for that of the bus
    std::int64_t began_ns = 0;  ///< of the newest start-up
    /// when its SYNC signals begin, on the clock of the cycle; 0: it has none
    std::int64_t sync_begins_ns = 0;
    unsigned attempts = 0;  ///< start-ups in a row that failed
    /// counters of 0300h as last read, per port
    std::array<std::array<std::uint8_t, 4>, 4> last_errors{};
};

/// See the top of this file.
struct Bus {
    Bus(Setup setup_, const std::array<std::uint8_t, 6>& source, Events& events_, CoeAccess& coe_);

    Setup setup;
    ProcessImage image;
    BusStatus status;
    WireEngine engine;
    Events& events;
    CoeAccess& coe;
    /// capacity of the bus; the number is that of the station address
    std::vector<std::unique_ptr<Device>> devices;
    std::vector<int> device_of;  ///< by index of Setup::slaves; -1: none
    /// status of the slaves of the setup that have no device
    std::vector<SlaveStatus> absent;
    /// By index of Setup::slaves: station address of a slave that may be in OP; 0: it is not.
    /// Written in the cycle, read by any thread.
    std::vector<std::atomic<std::uint16_t>> in_op;
    Channel bus_channel{32 * 1024}, watch_channel;
    std::vector<std::uint16_t> by_position;  ///< device numbers along the line
    std::vector<WkcState> wkc_seen;  ///< of the domains, as last reported
    unsigned known = 0;  ///< slaves on the bus after the newest scan
    bool outputs_valid = true;  ///< the slaves may go to OP
    bool exchange = false;  ///< process data frames are sent
    /// every slave that is not optional is in the state that the setup names; its process data may
    /// be stale
    bool settled = false;
    std::uint64_t late_seen = 0;  ///< BusStatus::late in the previous cycle
    std::uint64_t staleness_seen = 0;  ///< ProcessImage::staleness() in the previous cycle
    bool suspicious = true;  ///< look at the slaves now
    /// the supervision waits; Master wakes it when `suspicious` is set
    bool resting = false;
    /// the newest look at the line found all slaves in OP, and no task of a slave has started or
    /// ended that since
    bool quiet = false;
    int reference = -1;  ///< device with the reference clock
    /// system time of the clocks minus the clock of the cycle
    std::int64_t epoch_ns = 0;
    /// system time minus the clock of the cycle, by the newest frame; 0: not known
    std::int64_t skew_ns = 0;
    /// `skew_ns` when no clock was beyond the window
    std::optional<std::int64_t> agreed_skew_ns;
    /// largest change of `skew_ns` between two looks at the clocks without a jump; it fades
    std::int64_t skew_jitter_ns = 0;
    int jumped = -1;  ///< device whose reference clock was reported to have jumped; -1: none
    std::int64_t jump_ns = 0;
    std::int64_t jumped_at_ns = 0;  ///< when the first clock behind it left the window
    /// of the slave last reported as unknown, so that it is reported once
    std::uint32_t unknown_product = 0;
    bool unknown_reported = false;  ///< a slave that is not in the setup, until it is gone
    /// positions of slaves whose EEPROM was reported as unreadable, so that it is reported once
    std::bitset<1024> unreadable;
    bool reported_empty = false;
    unsigned reported_many = 0;  ///< slaves that were reported as too many
    /// the newest broadcast found the ring in another state
    bool ring_changed = false;

    const Slave* config(const Device& d) const noexcept {
        return d.slave.configured < 0 ? nullptr
                                      : &setup.slaves[static_cast<std::size_t>(d.slave.configured)];
    }
    /// Reports an event of a slave, or of the bus.
    void report(Event event, const Device& d, std::int64_t first = 0,
                std::int64_t second = 0) noexcept {
        const auto n = static_cast<std::uint32_t>(d.slave.configured);
        events.on_event(event, d.slave.configured >= 0 ? n : Events::of_position + d.slave.position,
                        first, second);
    }
    void report(Event event, std::int64_t first = 0, std::int64_t second = 0) noexcept {
        events.on_event(event, Events::bus, first, second);
    }
    /// Starts a task on the channel of a device: run(d, [&] { return boot(d.channel, bus, d); }).
    template <class Make>
    void run(Device& d, Make&& make) noexcept {
        quiet = false;
        d.channel.set_now(engine.now_ns());
        d.channel.start(make);
    }
    /// Returns whether a slave has a clock that is not set, or the reference clock is lost.
    bool clocks_missing() const noexcept;
    /// Returns the system time at the start of the cycle, as well as it is known.
    std::uint64_t dc_now() const noexcept;
    /// Takes a slave out of the working counters and the list of those present.
    void leave(Device&) noexcept;
    /// Returns the state that a slave is to be brought to.
    State target(const Device& d) const noexcept {
        if (d.to_boot) return State::boot;
        const Slave* slave = config(d);
        return slave != nullptr ? slave->target : State::preop;
    }
    /// Notes that a slave is no longer in its state, or is about to leave it.
    void unsettle(Device& d) noexcept {
        d.settled = false;
        set_in_op(d, false);
    }
    /// Sets whether a start-up brought a slave to OP. It is operational while its process data is
    /// exchanged, too.
    void set_in_op(Device& d, bool is_in_op) noexcept {
        quiet &= d.in_op == is_in_op;
        d.in_op = is_in_op;
        d.status.operational = d.in_op && !d.stale;
    }
    /// Lets shut_down() address the slave while it may be in OP.
    void note_in_op(const Device&, bool in_op) noexcept;
    void update_status() noexcept;  ///< Derives the state of the bus from those of the slaves.
};

// Registers of one slave. The data stays in channel.data().
inline Channel::Exchange read(Channel& c, const BusSlave& s, std::uint16_t address,
                              std::uint16_t length) noexcept {
    return c.exchange(Command::fprd, at_station(s.station, address), length);
}
template <class T>
Channel::Exchange write(Channel& c, const BusSlave& s, std::uint16_t address, T value) noexcept {
    put(c.data(), value);
    return c.exchange(Command::fpwr, at_station(s.station, address), sizeof value);
}
template <class T>
Channel::Exchange write_all(Channel& c, std::uint16_t address, T value) noexcept {
    put(c.data(), value);
    return c.exchange(Command::bwr, at_position(0, address), sizeof value);
}
/// Writes `length` zeros to all slaves.
inline Channel::Exchange clear_all(Channel& c, std::uint16_t address,
                                   std::uint16_t length) noexcept {
    std::memset(c.data(), 0, length);
    return c.exchange(Command::bwr, at_position(0, address), length);
}

// scan.cpp
/// Finds and identifies all slaves. False: none, or too many.
Task<bool> scan(Channel&, Bus&) noexcept;
/// Reads the registers and the SII of the slave at its station address.
Task<bool> identify(Channel&, Bus&, BusSlave&) noexcept;
Task<void> scan_one(Channel&, Bus&, Device&) noexcept;
/// Returns whether a slave is the one that the setup names.
bool matches(Bus&, const Slave&, const BusSlave&, Device* to_report) noexcept;
/// Compares alias, device identification, or position.
bool is_at_its_place(const Slave&, const BusSlave&) noexcept;
void assign(Bus&) noexcept;  ///< Finds the slaves of the setup among those on the bus.

// slave_boot.cpp
/// Brings a slave to its target state; repeats it until that is reached.
Task<void> boot(Channel&, Bus&, Device&) noexcept;
Task<bool> request_state(Channel&, Bus&, Device&, State, std::uint32_t timeout_ms) noexcept;
/// Reads AL status into the slave. False: no answer.
Task<bool> read_state(Channel&, Bus&, Device&) noexcept;

// slave_setup.cpp
Task<bool> set_mailbox(Channel&, Bus&, Device&) noexcept;  ///< Sync managers 0 and 1.
/// Sync managers 2.., FMMUs, watchdog.
Task<bool> set_process_data(Channel&, Bus&, Device&) noexcept;
/// Disables sync managers, FMMUs and SYNC signals.
Task<bool> clear_settings(Channel&, Bus&, Device&) noexcept;
Task<void> clear_process_data(Channel&, Bus&, Device&) noexcept;  ///< Disables the FMMUs.
Task<bool> startup_writes(Channel&, Bus&, Device&, State before) noexcept;

// pdo_mapping.cpp
/// Writes what differs of mapping and assignment.
Task<bool> map_process_data(Channel&, Bus&, Device&) noexcept;

// distributed_clocks.cpp
/// Measures delays; sets offset and delay of the clocks that have none.
Task<void> start_clocks(Channel&, Bus&) noexcept;
/// Waits for a clock to be within the window.
Task<bool> synchronise(Channel&, Bus&, Device&) noexcept;
/// Reports a clock that synchronise() accepted outside the window.
void report_tolerated_clock(Bus&, const Device&) noexcept;
Task<bool> start_sync_signals(Channel&, Bus&, Device&) noexcept;
/// Takes the time of the reference clock that the newest frame carried.
void take_clock(Bus&) noexcept;

// supervision.cpp
Task<void> supervise(Channel&, Bus&) noexcept;
Task<void> watch(Channel&, Bus&) noexcept;
Task<void> check(Channel&, Bus&, Device&) noexcept;
void update_working_counters(Bus&) noexcept;  ///< Reports changes of the working counters.
/// Follows whether the process data of the slaves is exchanged, in each cycle. `may_change`: tasks
/// may have changed their states.
void check_process_data(Bus&, bool may_change) noexcept;

// redundancy.cpp
/// Finds the break of a ring, by how far the primary port reaches.
void check_ring(Bus&, unsigned responding) noexcept;

}  // namespace hal::ethercat::master
