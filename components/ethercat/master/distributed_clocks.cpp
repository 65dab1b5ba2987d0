// SPDX-License-Identifier: MIT
// Distributed clocks (ETG.1000.4, clause 6.7): delays from one latch of all receive times, offsets
// to the clock of the cycle, drift by the reference clock's time in every cyclic frame, SYNC
// signals on one grid.
#include <algorithm>

#include "ethercat/master/bus.hpp"
#include "ethercat/master/topology.hpp"

namespace hal::ethercat::master {

namespace {

constexpr std::int64_t synchronise_timeout_ns = 5'000 * millisecond;

// How far ahead SYNC0 starts: the two writes take a cycle each, and some are repeated. When they
// took longer, the start is repeated with twice the time.
constexpr std::int64_t sync_start_ns = 10 * millisecond;
constexpr std::int64_t sync_start_cycles = 10;
constexpr unsigned sync_start_attempts = 5;
constexpr std::uint32_t usual_hop_ns = 700;  ///< a slave and a short cable
constexpr std::uint16_t receive_time_bytes = 32;  ///< 0900h to 091Fh

Task<void> read_times(Channel& c, Device& d) noexcept {
    BusSlave& s = d.slave;
    d.times_read = false;
    const Answer a = co_await read(c, s, registers::dc_receive_time, receive_time_bytes);
    if (a.wkc != 1) co_return;
    std::memcpy(s.receive_time.data(), c.data(), 16);
    s.local_time = get<std::uint64_t>(c.data() + 0x18);
    if (!s.has_dc64()) {
        s.local_time = static_cast<std::uint32_t>(s.local_time);
    }
    d.times_read = true;
}

Task<void> set_clock(Channel& c, Device& d, std::uint64_t offset) noexcept {
    put(c.data(), offset);
    put(c.data() + 8, d.slave.delay_ns);
    const Answer a = co_await c.exchange(
        Command::fpwr, at_station(d.slave.station, registers::dc_system_time_offset), 12);
    if (a.wkc != 1) co_return;
    // resets the filters
    co_await write<std::uint16_t>(c, d.slave, registers::dc_speed_counter_start, 0x1000);
    d.clock_set = true;
}

/// Starts work on the channel of a slave, or does it here if that channel is in use.
template <class Make>
Task<void> start_or_do(Channel& c, Bus& bus, Device& d, Make make) noexcept {
    if (d.channel.busy()) {
        co_await make(c);
        co_return;
    }
    d.helping = true;
    bus.run(d, [&] { return make(d.channel); });
}

Task<void> wait_for_helpers(Channel& c, Bus& bus) noexcept {
    for (const auto& d : bus.devices) {
        while (d->helping && d->channel.busy()) {
            co_await c.sleep(0);
        }
        d->helping = false;
    }
}

/// Returns whether the delay of a slave follows from times of one latch: its own and those of all
/// clocks between the reference and it.
bool has_valid_delay(const Bus& bus, const Device& d, std::size_t slaves) noexcept {
    // more: the ports are others than those that were read
    constexpr std::uint32_t max_ns = 100'000;
    constexpr std::uint32_t max_per_slave_ns = 20'000;
    if (bus.engine.redundant()) return d.times_read;
    std::size_t steps = 0;
    for (int parent = d.slave.parent; parent >= 0 && steps < slaves;
         parent = bus.devices[static_cast<std::size_t>(parent)]->slave.parent, ++steps) {
        const Device& before = *bus.devices[static_cast<std::size_t>(parent)];
        if (before.slave.has_dc() && before.slave.present && !before.times_read) return false;
    }
    return d.times_read && d.slave.delay_ns <= max_ns + max_per_slave_ns * slaves;
}

int choose_reference(const Bus& bus) noexcept {
    if (bus.setup.reference_slave && *bus.setup.reference_slave < bus.device_of.size()) {
        if (const int n = bus.device_of[*bus.setup.reference_slave];
            n >= 0 && bus.devices[static_cast<std::size_t>(n)]->slave.has_dc()) {
            return n;
        }
    }
    int first = -1;
    for (const std::uint16_t number : bus.by_position) {
        const Device& d = *bus.devices[number];
        if (d.slave.present && d.clock_set && d.slave.has_dc64()) return number;
    }
    for (const std::uint16_t number : bus.by_position) {
        const BusSlave& s = bus.devices[number]->slave;
        if (!s.present || !s.has_dc()) continue;
        if (s.has_dc64()) return number;
        if (first < 0) {
            first = number;
        }
    }
    return first;
}

/// Deviation of 092Ch: bit 31 is its sign (not the same in all controllers).
std::uint32_t magnitude(std::uint32_t difference) noexcept { return difference & 0x7fff'ffff; }

/// Returns whether clocks are to be started: some slave wants one and some slave has one, or they
/// run already.
bool wants_clocks(const Bus& bus) noexcept {
    if (bus.reference >= 0) return true;
    const bool wanted = std::any_of(bus.setup.slaves.begin(), bus.setup.slaves.end(),
                                    [](const Slave& s) { return s.dc.has_value(); });
    const auto has_clock = [&bus](std::uint16_t number) {
        const BusSlave& slave = bus.devices[number]->slave;
        return slave.present && slave.has_dc();
    };
    return wanted && std::any_of(bus.by_position.begin(), bus.by_position.end(), has_clock);
}

const Device& reference_of(const Bus& bus) noexcept {
    return *bus.devices[static_cast<std::size_t>(bus.reference)];
}

/// Chooses a reference clock when the bus has no present one. Returns false when no slave has a
/// clock.
bool ensure_reference(Bus& bus) noexcept {
    if (bus.reference >= 0 && reference_of(bus).slave.present) return true;
    // a running clock, if there is one, so that the time of the others continues
    const int chosen = choose_reference(bus);
    if (chosen < 0) return false;
    bus.reference = chosen;
    bus.report(Event::reference_clock, reference_of(bus), reference_of(bus).slave.has_dc64());
    return true;
}

/// Finds the delays of all slaves from the times that their ports latched. Returns the number of
/// slaves on the line.
std::size_t measure_delays(Bus& bus) noexcept {
    std::array<BusSlave*, 1024> line{};
    std::size_t count = 0;
    std::size_t reference = 0;
    for (const std::uint16_t number : bus.by_position) {
        if (count == line.size()) break;
        if (number == bus.reference) {
            reference = count;
        }
        line[count++] = &bus.devices[number]->slave;
    }
    if (!bus.engine.redundant()) {
        find_delays({line.data(), count}, reference);
        return count;
    }
    // On a ring no frame returns to a port, so that nothing can be measured: the usual delay of a
    // hop is taken. The error is some 100 ns for each.
    for (std::size_t n = 0; n < count; ++n) {
        const std::size_t hops = n > reference ? n - reference : 0;
        line[n]->delay_ns = static_cast<std::uint32_t>(hops) * usual_hop_ns;
    }
    return count;
}

/// Latches the time at which a frame passes each port, and reads the times of all clocks. Returns
/// when the frame was sent; negative: it was lost.
Task<std::int64_t> latch_times(Channel& c, Bus& bus) noexcept {
    const Answer latched = co_await clear_all(c, registers::dc_receive_time, 4);
    if (!latched.arrived || latched.wkc == 0) co_return -1;
    const std::int64_t latched_ns = c.sent_ns();
    for (const std::uint16_t number : bus.by_position) {
        Device& d = *bus.devices[number];
        if (d.slave.present && d.slave.has_dc()) {
            co_await start_or_do(c, bus, d, [&d](Channel& on) { return read_times(on, d); });
        }
    }
    co_await wait_for_helpers(c, bus);
    co_return latched_ns;
}

/// Sets the clocks that are not set yet, on a line of `count` slaves.
Task<void> set_clocks(Channel& c, Bus& bus, std::int64_t latched_ns, std::size_t count) noexcept {
    const std::int64_t to_system = bus.skew_ns != 0 ? bus.skew_ns : bus.epoch_ns;
    for (const std::uint16_t number : bus.by_position) {
        Device& d = *bus.devices[number];
        const BusSlave& s = d.slave;
        // never those of running slaves
        if (!s.present || !s.has_dc() || d.clock_set || !has_valid_delay(bus, d, count)) continue;
        // The frame with the latch passed this slave a delay after it passed the reference clock.
        const auto system = static_cast<std::uint64_t>(latched_ns + to_system) + s.delay_ns;
        const std::uint64_t offset = system - s.local_time;
        co_await start_or_do(c, bus, d,
                             [&d, offset](Channel& on) { return set_clock(on, d, offset); });
    }
    co_await wait_for_helpers(c, bus);
}

/// Lets the first clock of the line lead again. A slave before the reference clock does not get its
/// time, because a frame passes it first. Not in a ring, where the order depends on the side that a
/// frame comes from.
void lead_with_first(Bus& bus) noexcept {
    if (bus.setup.reference_slave || bus.engine.redundant()) return;
    const int first = choose_reference(bus);
    if (first < 0 || first == bus.reference) return;
    const Device& d = *bus.devices[static_cast<std::size_t>(first)];
    if (!d.clock_set || !d.slave.has_dc64()) return;
    bus.reference = first;
    bus.report(Event::reference_clock, d, 1);
}

}  // namespace

Task<void> start_clocks(Channel& c, Bus& bus) noexcept {
    if (!wants_clocks(bus)) co_return;
    const int reference_before = bus.reference;
    const std::int64_t latched_ns = co_await latch_times(c, bus);
    if (latched_ns < 0 || !ensure_reference(bus)) co_return;
    co_await set_clocks(c, bus, latched_ns, measure_delays(bus));
    lead_with_first(bus);
    const BusSlave& leader = reference_of(bus).slave;
    bus.image.set_reference(leader.station, bus.setup.lead == ClockLead::thread);
    bus.status.dc_active = true;
    // Until now this slave followed other times. What its filter made of them, a reference clock
    // would keep for good.
    if (bus.reference != reference_before) {
        co_await c.sleep(2 * bus.setup.cycle_ns);  // frames with the other reference are back
        co_await write<std::uint16_t>(c, leader, registers::dc_speed_counter_start, 0x1000);
    }
}

Task<bool> synchronise(Channel& c, Bus& bus, Device& d) noexcept {
    const Slave* config = bus.config(d);
    if (config == nullptr || !config->dc) co_return true;
    if (!d.slave.has_dc()) {
        bus.report(Event::dc_unsupported, d);
        co_return false;
    }
    const std::int64_t until = c.now_ns() + synchronise_timeout_ns;
    const auto window = static_cast<std::uint32_t>(bus.setup.sync_window_ns);
    unsigned within = 0;
    std::uint32_t deviation = UINT32_MAX;
    while (within < 3) {
        if (d.clock_set) {
            const Answer a = co_await read(c, d.slave, registers::dc_system_time_difference, 4);
            if (!a.arrived || a.wkc != 1) co_return false;
            deviation = d.status.dc_deviation_ns = magnitude(get<std::uint32_t>(c.data()));
            within = deviation <= window || d.slave.number == bus.reference ? within + 1 : 0;
        } else {
            co_await c.sleep(0);
        }
        if (c.now_ns() < until) continue;
        if (deviation <= tolerable_deviation_ns) break;
        if (deviation == UINT32_MAX) {
            bus.report(Event::dc_not_set, d, synchronise_timeout_ns / millisecond);
        } else {
            bus.report(Event::dc_timeout, d, deviation, window);
        }
        d.clock_set = false;  // it is set again before the next start-up
        bus.suspicious = true;
        co_return false;
    }
    d.synchronised = true;
    co_return true;
}

void report_tolerated_clock(Bus& bus, const Device& d) noexcept {
    const Slave* config = bus.config(d);
    if (config == nullptr || !config->dc || d.slave.number == bus.reference) return;
    const std::int64_t deviation = d.status.dc_deviation_ns;
    if (deviation <= bus.setup.sync_window_ns) return;
    bus.report(Event::dc_tolerated, d, deviation, bus.setup.sync_window_ns);
}

Task<bool> start_sync_signals(Channel& c, Bus& bus, Device& d) noexcept {
    const Slave& config = *bus.config(d);
    d.sync_begins_ns = 0;
    if (!config.dc || config.dc->assign_activate == 0) co_return true;
    const Dc& dc = *config.dc;
    const auto cycle =
        static_cast<std::uint64_t>(dc.sync0_cycle_ns > 0 ? dc.sync0_cycle_ns : bus.setup.cycle_ns);
    co_await write<std::uint8_t>(c, d.slave, registers::dc_activation, 0);
    if ((dc.assign_activate & 0xff) != 0) {
        co_await write(c, d.slave, registers::dc_cyclic_unit_control,
                       static_cast<std::uint8_t>(dc.assign_activate & 0xff));
    }
    put(c.data(), static_cast<std::uint32_t>(cycle));
    put(c.data() + 4,
        static_cast<std::uint32_t>(dc.sync1_cycle_ns > 0 ? dc.sync1_cycle_ns + dc.sync1_shift_ns
                                                         : dc.sync1_shift_ns));
    Answer a = co_await c.exchange(Command::fpwr,
                                   at_station(d.slave.station, registers::dc_sync0_cycle), 8);
    if (a.wkc != 1) co_return false;
    // The grid of all slaves starts at system time 0, so all SYNC0 of one cycle time coincide but
    // for their shift. With a SYNC0 at a fraction of the cycle, its first pulse begins a cycle,
    // from which SYNC1 and the samples are counted.
    const auto period = static_cast<std::uint64_t>(bus.setup.cycle_ns);
    const bool is_fraction = cycle < period && period % cycle == 0;
    const std::uint64_t step = is_fraction ? period : cycle;
    const auto grid = static_cast<std::int64_t>(step);
    // of any length: it begins soon
    const auto shift = static_cast<std::uint64_t>((dc.sync0_shift_ns % grid + grid) % grid);
    const std::int64_t least = std::max(sync_start_ns, sync_start_cycles * bus.setup.cycle_ns);
    for (unsigned attempt = 0; attempt < sync_start_attempts; ++attempt) {
        const auto ahead = static_cast<std::uint64_t>(least << attempt);
        const std::uint64_t start = (bus.dc_now() + ahead) / step * step + step + shift;
        d.sync_begins_ns = c.now_ns() + static_cast<std::int64_t>(start - bus.dc_now());
        a = co_await write(c, d.slave, registers::dc_start_time, start);
        if (a.wkc != 1) co_return false;
        a = co_await write(c, d.slave, registers::dc_activation,
                           static_cast<std::uint8_t>(dc.assign_activate >> 8));
        if (a.wkc != 1) co_return false;
        // A unit that is activated after its start time waits until its counter has wrapped.
        if (c.now_ns() < d.sync_begins_ns) co_return true;
        co_await write<std::uint8_t>(c, d.slave, registers::dc_activation, 0);
    }
    co_return false;
}

void take_clock(Bus& bus) noexcept {
    const auto& sample = bus.engine.clock();
    if (!sample.fresh || bus.reference < 0) return;
    std::uint64_t time = sample.dc_ns;
    if (!bus.devices[static_cast<std::size_t>(bus.reference)]->slave.has_dc64()) {
        const std::uint64_t guess =
            bus.status.dc_time_ns != 0
                ? bus.status.dc_time_ns
                : static_cast<std::uint64_t>(bus.engine.now_ns() + bus.epoch_ns);
        const auto step = static_cast<std::int32_t>(static_cast<std::uint32_t>(time) -
                                                    static_cast<std::uint32_t>(guess));
        time = guess + static_cast<std::uint64_t>(static_cast<std::int64_t>(step));
    }
    bus.status.dc_time_ns = time;
    if (bus.devices[static_cast<std::size_t>(bus.reference)]->clock_set) {
        bus.skew_ns = static_cast<std::int64_t>(time) - sample.sent_ns;
    }
}

}  // namespace hal::ethercat::master
