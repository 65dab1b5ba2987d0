// SPDX-License-Identifier: MIT
// The work for the whole bus: scan, start-up of all slaves at once, then the watch for slaves that
// fail, go, or return.
#include <algorithm>
#include <cstdlib>

#include "ethercat/master/bus.hpp"
#include "ethercat/master/topology.hpp"

namespace hal::ethercat::master {

namespace {

constexpr std::int64_t look_every_ns = 10 * millisecond;
constexpr std::int64_t empty_retry_ns = 100 * millisecond;

constexpr std::int64_t rediscover_every_ns = 50 * millisecond;
constexpr std::int64_t counters_every_ns = 1'000 * millisecond;
constexpr std::int64_t clocks_every_ns = 100 * millisecond;
constexpr std::uint16_t spare_station = 0x0fff;
constexpr std::uint8_t counter_high = 0x80;
/// In a second: fewer may be damaged or late ones.
constexpr std::uint64_t other_master_frames = 10;

/// Finds the tree; `changed`: the ports may have changed since the slaves were identified.
Task<void> find_ports(Channel& c, Bus& bus, bool changed) noexcept {
    std::array<BusSlave*, 1024> line{};
    std::size_t count = 0;
    for (const std::uint16_t number : bus.by_position) {
        BusSlave& s = bus.devices[number]->slave;
        if (count == line.size()) break;
        if (changed && s.present) {
            const Answer a = co_await read(c, s, registers::dl_status, 2);
            if (a.wkc == 1) {
                s.dl_status = get<std::uint16_t>(c.data());
            }
        }
        line[count++] = &s;
    }
    find_tree({line.data(), count});
}

void start(Bus& bus, Device& d) noexcept {
    if (d.refused || !d.identified) return;
    if (d.slave.configured < 0) {
        if (bus.setup.accept_other_slaves || bus.setup.slaves.empty()) {
            bus.run(d, [&] { return boot(d.channel, bus, d); });
        }
        return;
    }
    bus.run(d, [&] { return boot(d.channel, bus, d); });
}

/// Returns the device of a configured slave; nullptr: it has none yet.
Device* device_of(const Bus& bus, std::size_t configured) noexcept {
    const int number = bus.device_of[configured];
    return number < 0 ? nullptr : bus.devices[static_cast<std::size_t>(number)].get();
}

/// Returns a device that is away and belongs to no configured slave; nullptr: all are in use.
Device* spare_device(const Bus& bus) noexcept {
    for (const auto& d : bus.devices) {
        if (!d->slave.present && d->slave.configured < 0) return d.get();
    }
    return nullptr;
}

/// A configured slave, and the device that it gets.
struct Seat {
    std::size_t configured = 0;
    Device* device = nullptr;  // nullptr: no configured slave is like it
};

/// Returns the first of the configured slaves that are missing and like this one.
Seat seat_of(Bus& bus, const BusSlave& found) noexcept {
    for (std::size_t n = 0; n < bus.setup.slaves.size(); ++n) {
        const Slave& want = bus.setup.slaves[n];
        Device* const before = device_of(bus, n);
        if (before != nullptr && before->slave.present) continue;
        const bool has_own_identity = want.identity.alias || want.identity.device_id;
        const bool may_be_anywhere = want.optional && !has_own_identity;
        if (!is_at_its_place(want, found) && !may_be_anywhere) continue;
        if (!matches(bus, want, found, nullptr)) continue;
        Device* const device = before != nullptr ? before : spare_device(bus);
        if (device != nullptr) return {n, device};
    }
    return {};
}

/// Reports a slave that no configured one is like: the position is known, the slave is another one.
void report_unknown(Bus& bus, const BusSlave& found) noexcept {
    for (std::size_t n = 0; n < bus.setup.slaves.size(); ++n) {
        Device* const device = device_of(bus, n);
        const Slave& want = bus.setup.slaves[n];
        if (want.position != found.position || device == nullptr || device->slave.present) continue;
        if (found.product != bus.unknown_product) {
            matches(bus, want, found, device);  // reports the difference
        }
    }
    if (std::exchange(bus.unknown_product, found.product) != found.product) {
        bus.unknown_reported = true;
        bus.events.on_event(Event::unknown_slave, Events::of_position + found.position,
                            found.vendor, found.product);
    }
}

/// Returns whether a slave without known address is a configured one that lost its power for so
/// short a time that it is still held to be there: none answers at the address which that one had.
Task<bool> lost_its_address(Channel& c, Bus& bus, const BusSlave& found) noexcept {
    for (std::size_t n = 0; n < bus.setup.slaves.size(); ++n) {
        const Device* const device = device_of(bus, n);
        if (device == nullptr || !device->slave.present) continue;
        const Slave& want = bus.setup.slaves[n];
        if (!is_at_its_place(want, found) || !matches(bus, want, found, nullptr)) continue;
        const Answer a = co_await read(c, device->slave, registers::al_status, 2);
        if (a.wkc != 1) co_return true;
    }
    co_return false;
}

/// Identifies a slave without known address at a position, and makes it one of those that are
/// missing. Returns its device, or -1.
Task<int> take_in(Channel& c, Bus& bus, std::uint16_t position) noexcept {
    BusSlave found;
    found.station = spare_station;
    found.position = position;
    // One that was not accepted before keeps the spare address; two of them would both answer.
    co_await write<std::uint16_t>(c, found, registers::station_address, 0);
    put(c.data(), spare_station);
    Answer a =
        co_await c.exchange(Command::apwr, at_position(position, registers::station_address), 2);
    if (a.wkc != 1) co_return -1;
    const bool identified = co_await identify(c, bus, found);
    if (!identified) co_return -1;
    const Seat seat = seat_of(bus, found);
    if (seat.device == nullptr) {
        const bool is_known = co_await lost_its_address(c, bus, found);
        if (!is_known) {
            report_unknown(bus, found);
        }
        co_return -1;  // one that is known is taken in when its loss was noticed
    }
    Device& d = *seat.device;
    const Slave& want = bus.setup.slaves[seat.configured];
    found.station = d.slave.station;
    found.number = d.slave.number;
    found.configured = static_cast<int>(seat.configured);
    found.present = true;
    found.timeouts = want.timeouts;
    found.complete_access = want.complete_access;
    put(c.data(), found.station);
    a = co_await c.exchange(Command::fpwr, at_station(spare_station, registers::station_address),
                            2);
    if (a.wkc != 1) co_return -1;
    d.slave = found;
    bus.device_of[seat.configured] = d.slave.number;
    d.identified = true;
    d.refused = false;
    d.clock_set = false;
    d.synchronised = false;
    d.status.online = true;
    bus.unknown_product = 0;
    co_return d.slave.number;
}

/// Walks along the line after a change, and takes in slaves that are new or returned.
Task<bool> rediscover(Channel& c, Bus& bus, unsigned count) noexcept {
    bool returned = false;
    std::vector<std::uint16_t>& line = bus.by_position;
    line.clear();  // capacity: all devices
    for (unsigned n = 0; n < count && n < bus.devices.size(); ++n) {
        const auto position = static_cast<std::uint16_t>(n);
        const Answer a =
            co_await c.exchange(Command::aprd, at_position(n, registers::station_address), 2);
        if (!a.arrived || a.wkc != 1) break;
        const auto station = get<std::uint16_t>(c.data());
        std::size_t number = static_cast<std::size_t>(station) - first_station;
        const bool known =
            station >= first_station && number < bus.devices.size() &&
            (bus.devices[number]->identified || bus.devices[number]->slave.present) &&
            std::find(line.begin(), line.end(), number) == line.end();
        if (!known) {
            const int taken = co_await take_in(c, bus, position);
            if (taken < 0) continue;
            number = static_cast<std::size_t>(taken);
        }
        Device& d = *bus.devices[number];
        const bool back = !d.slave.present || !known;
        d.slave.position = position;
        line.push_back(static_cast<std::uint16_t>(number));
        if (!back) continue;
        d.slave.present = d.status.online = true;
        d.clock_set = d.synchronised = false;
        returned = true;
        bus.report(Event::slave_returned, d, position);
    }
    co_return returned;
}

/// Slaves that are there and neither in start-up nor running.
void start_returned(Bus& bus) noexcept {
    for (const std::uint16_t number : bus.by_position) {
        Device& d = *bus.devices[number];
        if (d.slave.present && !d.settled && !d.channel.busy()) {
            start(bus, d);
        }
    }
}

}  // namespace

Task<void> check(Channel& c, Bus& bus, Device& d) noexcept {
    unsigned silent = 0;
    bool here = false;
    while (!here && silent < 3) {
        here = co_await read_state(c, bus, d);
        if (!here) {
            ++silent;
        }
    }
    if (!here) {
        bus.leave(d);
        ++d.status.losses;
        bus.report(Event::slave_lost, d, d.slave.position);
        co_return;
    }
    const bool settles = bus.config(d) != nullptr && !d.to_boot;
    if (d.slave.state == bus.target(d) && !d.slave.al_failed && (d.settled || !settles)) co_return;
    if (d.settled) {
        const auto status = static_cast<std::uint16_t>(static_cast<unsigned>(d.slave.state) |
                                                       (d.slave.al_failed ? al_error : 0U));
        bus.report(Event::fell_back, d, status, d.slave.al_code);
    }
    bus.unsettle(d);
    d.began_ns = c.now_ns();
    co_await boot(c, bus, d);
}

/// Scans until there are slaves, and starts them.
static Task<void> start_line(Channel& c, Bus& bus) noexcept {
    while (true) {
        const bool scanned = co_await scan(c, bus);
        if (scanned) break;
        co_await c.sleep(empty_retry_ns);
    }
    co_await find_ports(c, bus, false);
    bus.exchange = !bus.setup.slaves.empty();
    co_await start_clocks(c, bus);
    for (const std::uint16_t number : bus.by_position) {
        start(bus, *bus.devices[number]);
    }
}

/// What one look at the line shows.
struct Look {
    unsigned count = 0;  ///< slaves that answer
    unsigned present = 0;  ///< slaves that are known
    std::uint16_t states = 0;  ///< the OR of their AL status
    bool at_rest = true;  ///< no slave is in start-up
    bool fine = false;  ///< nothing is to be done
};

/// Returns whether all known slaves answer, in OP, with their process data.
static bool all_answer(const Bus& bus, const Look& look) noexcept {
    return look.count == bus.known && look.states == static_cast<std::uint16_t>(State::op) &&
           (bus.status.wkc_expected == 0 || bus.status.wkc_state == WkcState::complete);
}

/// Counts the slaves that answer and those that are known.
static Task<Look> look_at_line(Channel& c, Bus& bus) noexcept {
    std::memset(c.data(), 0, 6);
    const Answer a = co_await c.exchange(Command::brd, at_position(0, registers::al_status), 6);
    Look look;
    look.count = a.arrived ? a.wkc : 0U;
    look.states = get<std::uint16_t>(c.data());
    bus.status.responding = static_cast<std::uint16_t>(look.count);
    if (bus.engine.redundant()) {
        check_ring(bus, look.count);
    }
    look.fine = bus.quiet && all_answer(bus, look);
    if (look.fine) co_return look;
    // On a broken ring the delays are others; they are frozen until it is closed.
    if (bus.clocks_missing() && !bus.status.ring_broken) {
        // a cable may have been closed without any slave lost
        co_await find_ports(c, bus, true);
        co_await start_clocks(c, bus);
    }
    // not by position: one that lost its address has none
    for (const auto& device : bus.devices) {
        const Device& d = *device;
        look.present += d.slave.present ? 1 : 0;
        look.at_rest &= !d.slave.present || d.settled;
    }
    look.fine = look.at_rest && look.present == look.count && all_answer(bus, look);
    bus.quiet = look.fine && !bus.clocks_missing();
    co_return look;
}

/// Ends the report of an unknown slave when every slave that answers is a configured one.
static void look_for_unknown(Bus& bus, const Look& look) noexcept {
    if (!bus.unknown_reported || look.count != look.present) return;
    for (const auto& device : bus.devices) {
        if (device->slave.present && device->slave.configured < 0) return;
    }
    bus.unknown_reported = false;
    bus.unknown_product = 0;
    bus.report(Event::unknown_gone, 0, 0);
}

/// Starts a look at each slave that may need one.
static void check_slaves(Bus& bus, const Look& look) noexcept {
    for (const auto& device : bus.devices) {
        Device& d = *device;
        const bool may_be_missing = d.slave.configured >= 0 || look.count < look.present;
        if (d.slave.present && !d.channel.busy() && !d.refused && d.identified && may_be_missing) {
            bus.run(d, [&] { return check(d.channel, bus, d); });
        }
    }
    if (look.count != bus.known) {
        bus.report(Event::topology_changed, bus.known, look.count);
        bus.known = look.count;
    }
}

Task<void> supervise(Channel& c, Bus& bus) noexcept {
    bus.resting = bus.quiet = false;
    co_await start_line(c, bus);
    std::int64_t rediscovered = c.now_ns();
    while (true) {
        bus.resting = true;
        if (!bus.suspicious) {
            co_await c.sleep(look_every_ns);
        }
        bus.resting = false;
        bus.suspicious = false;
        const Look look = co_await look_at_line(c, bus);
        look_for_unknown(bus, look);
        if (look.fine) continue;
        check_slaves(bus, look);
        const bool somebody_waits =
            look.present < look.count || bus.status.responding > look.present;
        if (!somebody_waits || c.now_ns() - rediscovered < rediscover_every_ns) continue;
        rediscovered = c.now_ns();
        const unsigned reachable =
            bus.status.ring_broken ? static_cast<unsigned>(bus.status.break_after + 1) : look.count;
        const bool returned = co_await rediscover(c, bus, reachable);
        if (!returned) continue;
        co_await find_ports(c, bus, true);
        start_returned(bus);
        bus.suspicious = true;  // for their clocks
    }
}

/// Takes a slave to SAFE-OP, where its outputs are off, until its clock is in the window again.
static Task<void> resynchronise(Channel& c, Bus& bus, Device& d) noexcept {
    bus.unsettle(d);
    d.began_ns = c.now_ns();
    bool ok = co_await request_state(c, bus, d, State::safeop, d.slave.timeouts.op_to_safeop);
    if (ok) {
        ok = co_await synchronise(c, bus, d);
    }
    if (ok) {
        ok = co_await request_state(c, bus, d, State::op, d.slave.timeouts.to_safeop_op);
    }
    if (!ok) {
        co_await boot(c, bus, d);
        co_return;
    }
    d.settled = true;
    bus.set_in_op(d, true);
    bus.report(Event::slave_operational, d, d.slave.position,
               (c.now_ns() - d.began_ns) / millisecond);
}

/// 092Ch has 31 bits for it; a larger deviation is shown as this one.
static constexpr std::int64_t largest_deviation_ns = 0x7fff'ffff;

/// Jumps of this size differ from the jitter of frames and the drift of clocks; smaller ones where
/// these are smaller.
static constexpr std::int64_t clear_jump_ns = 100'000;

/// What a clock makes up of a jump until it is looked at: 250 ppm of the time between two looks.
static constexpr std::int64_t corrected_ns = clocks_every_ns / 4000;

/// Returns by how much the reference clock has jumped against the clock of the cycle, when that is
/// why a slave deviates by `deviation_ns` from it; 0: it is not.
static std::int64_t jump_of_reference(const Bus& bus, std::int64_t deviation_ns) noexcept {
    if (!bus.agreed_skew_ns || bus.reference < 0) return 0;
    const std::int64_t jump = bus.skew_ns - *bus.agreed_skew_ns;
    const std::int64_t size = std::abs(jump);
    if (size < std::clamp(2 * bus.skew_jitter_ns, tolerable_deviation_ns, clear_jump_ns)) return 0;
    if (deviation_ns >= largest_deviation_ns) return size >= largest_deviation_ns ? jump : 0;
    const bool alike =
        deviation_ns <= size + size / 4 && deviation_ns + corrected_ns >= size - size / 4;
    return alike ? jump : 0;
}

/// Notes that no clock is beyond the window, and how much the time of the reference clock varies
/// against that of the cycle.
static void note_agreement(Bus& bus) noexcept {
    if (bus.agreed_skew_ns) {
        const std::int64_t change = std::abs(bus.skew_ns - *bus.agreed_skew_ns);
        const std::int64_t faded = bus.skew_jitter_ns - bus.skew_jitter_ns / 16;
        bus.skew_jitter_ns = change < clear_jump_ns ? std::max(change, faded) : faded;
    }
    bus.agreed_skew_ns = bus.skew_ns;
}

/// Notes that the clock of a slave has left the window, and whether the reference clock is why.
static void note_deviation(Bus& bus, Device& d, std::int64_t now_ns) noexcept {
    d.drifts_since_ns = now_ns;
    const std::int64_t jump = jump_of_reference(bus, d.status.dc_deviation_ns);
    d.follows_jump = jump != 0;
    if (d.follows_jump) {
        bus.jump_ns = jump;
    }
}

/// Reports the clock that is out of step: that of the slave, or the reference clock, once for all
/// slaves behind it.
static void report_deviation(Bus& bus, const Device& d, std::int64_t window_ns) noexcept {
    const std::int64_t deviation = d.status.dc_deviation_ns;
    if (!d.follows_jump) {
        const bool is_far = deviation >= largest_deviation_ns;
        return bus.report(is_far ? Event::dc_far : Event::dc_lost, d, deviation, window_ns);
    }
    if (bus.jumped >= 0) return;
    bus.jumped = bus.reference;
    bus.jumped_at_ns = d.drifts_since_ns;
    bus.report(Event::dc_jumped, *bus.devices[static_cast<std::size_t>(bus.jumped)], bus.jump_ns,
               window_ns);
}

/// Reports that the clocks behind a reference clock that had jumped are within the window again.
static void end_jump(Bus& bus, std::uint32_t max_deviation_ns, std::int64_t now_ns) noexcept {
    if (bus.jumped < 0) return;
    bus.report(Event::dc_jump_ended, *bus.devices[static_cast<std::size_t>(bus.jumped)],
               max_deviation_ns, (now_ns - bus.jumped_at_ns) / millisecond);
    bus.jumped = -1;
}

/// Reports a slave that is not in step for some time although it is in OP, and stops it where the
/// setup requires it; reports it when it is again.
static void check_clock(Bus& bus, Device& d, std::int64_t now_ns) noexcept {
    const Slave* config = bus.config(d);
    const std::int64_t window = std::max(bus.setup.sync_window_ns, tolerable_deviation_ns);

    const std::int64_t deviation = d.status.dc_deviation_ns;
    if (config == nullptr || !config->dc || d.slave.number == bus.reference ||
        !d.status.operational) {
        d.drifted = false;
        d.drifts_since_ns = 0;
    } else if (deviation > window) {
        if (d.drifts_since_ns == 0) {
            note_deviation(bus, d, now_ns);
        }
        if (d.drifted || now_ns - d.drifts_since_ns < bus.setup.dc_loss_ns || d.channel.busy()) {
            return;
        }
        d.drifted = true;
        report_deviation(bus, d, window);
        if (bus.setup.dc_loss == DcLoss::safeop) {
            bus.run(d, [&] { return resynchronise(d.channel, bus, d); });
        }
    } else if (!d.drifted) {
        d.drifts_since_ns = 0;
    } else if (deviation <= bus.setup.sync_window_ns) {
        if (!d.follows_jump) {
            const std::int64_t drifted_ns = now_ns - d.drifts_since_ns;
            bus.report(Event::dc_recovered, d, deviation, drifted_ns / millisecond);
        }
        d.drifted = false;
        d.drifts_since_ns = 0;
    }
}

/// Reads the deviation of every clock that is set.
static Task<void> look_at_clocks(Channel& c, Bus& bus) noexcept {
    std::uint32_t max = 0;
    bool any = false;
    bool all = true;
    for (const auto& device : bus.devices) {
        Device& d = *device;
        if (!d.slave.present || !d.identified) continue;
        const Slave* config = bus.config(d);
        all &= config == nullptr || !config->dc || d.clock_set || d.refused;
        if (!d.clock_set) continue;
        const Answer a = co_await read(c, d.slave, registers::dc_system_time_difference, 4);
        if (a.wkc != 1) continue;
        d.status.dc_deviation_ns = get<std::uint32_t>(c.data()) & 0x7fff'ffff;
        check_clock(bus, d, c.now_ns());
        if (d.slave.number != bus.reference) {
            max = std::max(max, d.status.dc_deviation_ns);
        }
        any = true;
    }
    bus.status.dc_deviation_ns = any ? max : UINT32_MAX;
    const bool synchronised = any && all && max <= bus.setup.sync_window_ns;
    if (synchronised && !bus.status.dc_synchronised) {
        bus.report(Event::dc_synchronised, max);
    }
    bus.status.dc_synchronised = synchronised;
    if (synchronised) {
        end_jump(bus, max, c.now_ns());
    }
}

/// Returns whether a clock of the line may be far beyond the window: one datagram reads them all,
/// as the OR of their deviations.
static Task<bool> may_drift(Channel& c, Bus& bus) noexcept {
    std::memset(c.data(), 0, 4);
    const Answer a =
        co_await c.exchange(Command::brd, at_position(0, registers::dc_system_time_difference), 4);
    co_return a.wkc != 0 && (get<std::uint32_t>(c.data()) & 0x7fff'ffff) >
                                std::max(bus.setup.sync_window_ns, tolerable_deviation_ns);
}

/// Returns what is at the other end of the cable at a port, as events name slaves.
std::uint32_t neighbour(const Bus& bus, const Device& d, unsigned port) noexcept {
    if (d.slave.position == 0 && port == d.slave.entry_port) return Events::bus;
    const int other = d.slave.neighbour[port];
    if (other < 0) return Events::nothing;
    const BusSlave& s = bus.devices[static_cast<std::size_t>(other)]->slave;
    return s.configured >= 0 ? static_cast<std::uint32_t>(s.configured)
                             : Events::of_position + s.position;
}

/// Adds the changes of the error counters of a port, which the slave reports in `now`. Returns
/// whether one of them is near its end.
static bool count_errors(Bus& bus, Device& d, unsigned port,
                         std::span<const std::uint8_t, 20> now) noexcept {
    PortErrors& errors = d.status.ports[port];
    const PortErrors before = errors;
    std::array<std::uint8_t, 4>& last = d.last_errors[port];
    const std::array<std::uint8_t, 4> values{now[2 * port], now[2 * port + 1], now[8 + port],
                                             now[16 + port]};
    const std::array<std::uint64_t*, 4> sums{&errors.invalid_frames, &errors.rx_errors,
                                             &errors.forwarded, &errors.lost_links};
    bool high = false;
    for (std::size_t n = 0; n < values.size(); ++n) {
        *sums[n] += values[n] >= last[n] ? values[n] - last[n] : values[n];
        high |= values[n] > counter_high;
    }
    last = values;
    const std::uint64_t damaged =
        errors.invalid_frames + errors.rx_errors - before.invalid_frames - before.rx_errors;
    // forwarded ones were damaged on an earlier cable
    if (damaged > errors.forwarded - before.forwarded) {
        bus.report(Event::damaged_frames, d, port | std::int64_t{neighbour(bus, d, port)} << 8,
                   static_cast<std::int64_t>(damaged));
    }
    return high;
}

/// Reads the error counters of a slave, and clears them before they stop at FFh.
static Task<void> read_counters(Channel& c, Bus& bus, Device& d) noexcept {
    const Answer a = co_await read(c, d.slave, registers::rx_errors, 20);
    if (a.wkc != 1) co_return;
    std::array<std::uint8_t, 20> now{};
    std::memcpy(now.data(), c.data(), now.size());
    bool high = false;
    for (unsigned port = 0; port < 4; ++port) {
        high |= count_errors(bus, d, port, now);
    }
    if (!high) co_return;
    std::memset(c.data(), 0, 20);
    co_await c.exchange(Command::fpwr, at_station(d.slave.station, registers::rx_errors), 20);
    for (auto& last : d.last_errors) {
        last.fill(0);
    }
}

/// Watches the clocks until `until_ns`.
static Task<void> watch_clocks(Channel& c, Bus& bus, std::int64_t until_ns) noexcept {
    while (c.now_ns() < until_ns) {
        const std::int64_t pause = std::min(clocks_every_ns, until_ns - c.now_ns());
        co_await c.sleep(pause);
        const bool any = std::any_of(bus.devices.begin(), bus.devices.end(),
                                     [](const auto& d) { return d->clock_set; });
        if (!any || pause < clocks_every_ns) continue;
        const bool looks = co_await may_drift(c, bus);
        const bool drifts = std::any_of(bus.devices.begin(), bus.devices.end(),
                                        [](const auto& d) { return d->drifts_since_ns != 0; });
        if (looks || drifts) {
            co_await look_at_clocks(c, bus);
        } else {
            note_agreement(bus);
        }
    }
}

Task<void> watch(Channel& c, Bus& bus) noexcept {
    std::uint64_t foreign = bus.status.foreign;
    std::uint64_t control = bus.status.foreign_control;
    bool other = false;
    while (true) {
        const std::int64_t began = c.now_ns();
        const std::uint64_t more = bus.status.foreign - std::exchange(foreign, bus.status.foreign);
        const std::uint64_t controls =
            bus.status.foreign_control - std::exchange(control, bus.status.foreign_control);
        const bool was_other = other;
        other = controls >= other_master_frames || (was_other && more >= other_master_frames);
        if (other && !was_other) {
            bus.report(Event::other_master, static_cast<std::int64_t>(more));
        }
        for (const auto& device : bus.devices) {
            Device& d = *device;
            if (d.slave.present && d.identified) {
                co_await read_counters(c, bus, d);
            }
        }
        co_await look_at_clocks(c, bus);
        co_await watch_clocks(c, bus, began + counters_every_ns);
    }
}

/// Reports that a domain became complete, or is no longer.
static void report_working_counter(Bus& bus, std::size_t n) noexcept {
    const DomainStatus& domain = bus.image.domain(n);
    WkcState& reported = bus.wkc_seen[n];
    const bool is_complete = domain.state == WkcState::complete;
    const bool was_complete = reported == WkcState::complete;
    if (is_complete == was_complete) return;
    bus.report(is_complete ? Event::wkc_complete : Event::wkc_incomplete,
               static_cast<std::int64_t>(n << 16 | domain.wkc), domain.expected);
    bus.suspicious = bus.suspicious || !is_complete;
    reported = is_complete ? WkcState::complete : WkcState::part;
}

/// The state of all domains together. Domains that expect nothing do not count as incomplete.
static WkcState working_counter_state(Bus& bus) noexcept {
    bool any_complete = false;
    bool any_incomplete = false;
    for (std::size_t n = 0; n < bus.image.domain_count(); ++n) {
        const DomainStatus& domain = bus.image.domain(n);
        if (domain.state == WkcState::complete) {
            any_complete = true;
        } else if (domain.expected != 0) {
            any_incomplete = true;
        }
    }
    if (!any_incomplete) return any_complete ? WkcState::complete : WkcState::none;
    return bus.status.wkc != 0 ? WkcState::part : WkcState::none;
}

void update_working_counters(Bus& bus) noexcept {
    std::uint16_t wkc = 0;
    std::uint16_t expected = 0;
    for (std::size_t n = 0; n < bus.image.domain_count(); ++n) {
        const DomainStatus& domain = bus.image.domain(n);
        wkc = static_cast<std::uint16_t>(wkc + domain.wkc);
        expected = static_cast<std::uint16_t>(expected + domain.expected);
        if (domain.fresh && domain.expected != 0) {
            report_working_counter(bus, n);
        }
    }
    bus.status.wkc = wkc;
    bus.status.wkc_expected = expected;
    bus.status.wkc_state = working_counter_state(bus);
}

/// Reports a slave in OP whose process data is not exchanged, and the end of that.
static void report_staleness(Bus& bus, Device& d, std::size_t slave, bool late) noexcept {
    if (d.stale_reported && !d.stale) {
        d.stale_reported = false;
        bus.report(Event::data_fresh, d, d.slave.position);
    } else if (!d.stale_reported && d.stale && d.in_op) {
        d.stale_reported = true;
        Staleness why = late ? Staleness::late : Staleness::lost;
        if (bus.image.returns(slave)) {
            why = Staleness::counter;
        }
        bus.report(Event::data_stale, d, static_cast<std::int64_t>(why));
    }
}

void check_process_data(Bus& bus, bool may_change) noexcept {
    const bool late = bus.status.late != std::exchange(bus.late_seen, bus.status.late);
    const std::uint64_t staleness = bus.image.staleness();
    const bool stale_changed = staleness != std::exchange(bus.staleness_seen, staleness);
    if (!stale_changed && !may_change) return;
    bool changed = false;
    for (std::size_t n = 0; n < bus.setup.slaves.size(); ++n) {
        Device* const d = device_of(bus, n);
        if (d == nullptr) continue;
        changed |= d->stale != bus.image.slave(n).stale;
        d->stale = bus.image.slave(n).stale;
        bus.set_in_op(*d, d->in_op);
        report_staleness(bus, *d, n, late);
    }
    if (changed) {
        bus.update_status();
    }
}

}  // namespace hal::ethercat::master
