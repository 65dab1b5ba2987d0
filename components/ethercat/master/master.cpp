// SPDX-License-Identifier: MIT
#include "ethercat/master/master.hpp"

#include <optional>
#include <utility>

#include "ethercat/master/bus.hpp"

namespace hal::ethercat::master {

namespace {

constexpr unsigned acyclic_frames_starting = 8;
constexpr unsigned acyclic_frames_operating = 2;
constexpr std::uint64_t link_check_cycles = 64;

}  // namespace

Master::Master(Setup setup, const std::array<std::uint8_t, 6>& source, Events& events,
               CoeAccess& coe)
    : bus_(std::make_unique<Bus>(std::move(setup), source, events, coe)) {}
Master::~Master() = default;

void Master::attach(ethernet::Port& primary, ethernet::Port* backup) {
    primary_ = &primary;
    backup_ = backup;
    bus_->engine.attach(primary, backup);
    bus_->engine.ready();
    bus_->status.redundant = backup != nullptr;
    bus_->status.link = true;  // receive() reports a missing one
}
void Master::add(Channel& channel) { bus_->engine.add(channel); }
void Master::set_epoch(std::int64_t epoch_ns) { bus_->epoch_ns = epoch_ns; }

void Master::receive(std::int64_t now_ns) noexcept {
    Bus& bus = *bus_;
    bus.engine.receive(now_ns);
    if (!bus.bus_channel.busy()) {
        rescan();
    }
    take_clock(bus);
    update_working_counters(bus);
    const bool tasks_ran = bus.engine.resumed() != std::exchange(resumed_, bus.engine.resumed());
    const bool was_quiet = std::exchange(was_quiet_, bus.quiet);
    const bool may_change = tasks_ran && !(was_quiet && bus.quiet);
    check_process_data(bus, may_change);
    if (bus.suspicious && bus.resting && bus.bus_channel.stage() == Channel::Stage::sleeping) {
        bus.bus_channel.wake();
    }
    if (may_change) {
        bus.update_status();  // only tasks change states
    }
    if (links_checked_++ % link_check_cycles != 0) return;
    const auto link = [&](ethernet::Port* port, bool& was, std::int64_t number) {
        if (port == nullptr) return;
        const bool up = port->statistics().up;
        if (up != was) {
            bus.report(up ? Event::link_restored : Event::link_lost, number);
            bus.suspicious = true;
        }
        was = up;
    };
    link(primary_, bus.status.link, 0);
    link(backup_, backup_up_, 1);
}

void Master::transmit(std::int64_t now_ns) noexcept {
    Bus& bus = *bus_;
    // The time of the reference clock as this frame passes it. It is what slaves get that only the
    // backup port reaches: the clock they follow must not change when a ring breaks.
    const std::int64_t ahead =
        bus.setup.lead != ClockLead::thread && bus.skew_ns != 0 ? bus.skew_ns : bus.epoch_ns;
    bus.engine.transmit(now_ns, bus.exchange, !bus.settled,
                        bus.settled ? acyclic_frames_operating : acyclic_frames_starting,
                        static_cast<std::uint64_t>(now_ns + ahead));
}

void Master::rescan() noexcept {
    Bus& bus = *bus_;
    bus.reference = -1;
    bus.skew_ns = 0;
    bus.agreed_skew_ns.reset();
    bus.skew_jitter_ns = 0;
    bus.jumped = -1;
    bus.status.dc_active = false;
    bus.image.set_reference(0, false);
    bus.bus_channel.set_now(bus.engine.now_ns());
    bus.watch_channel.set_now(bus.engine.now_ns());
    bus.bus_channel.start([&] { return supervise(bus.bus_channel, bus); });
    bus.watch_channel.start([&] { return watch(bus.watch_channel, bus); });
}

std::span<std::uint8_t> Master::data(std::size_t slave, std::size_t n) noexcept {
    return bus_->image.data(slave, n);
}

void Master::shut_down() noexcept {
    if (primary_ == nullptr) return;
    std::array<std::uint8_t, max_frame_bytes> buffer;
    std::optional<FrameWriter> frame;
    const auto send = [&] {
        if (frame) {
            bus_->engine.send_now(frame->finish());
        }
        frame.reset();
    };
    for (const std::atomic<std::uint16_t>& in_op : bus_->in_op) {
        const std::uint16_t station = in_op.load(std::memory_order_relaxed);
        if (station == 0) continue;
        if (frame && frame->space() < sizeof station) {
            send();
        }
        if (!frame) {
            frame.emplace(buffer, primary_->address(), bus_->setup.frame_bytes);
        }
        const std::uint32_t control = at_station(station, registers::al_control);
        std::uint8_t* data = frame->add(Command::fpwr, 0, control, sizeof station);
        if (data != nullptr) {
            put(data, static_cast<std::uint16_t>(State::safeop));
        }
    }
    send();
}

void Master::restart() noexcept {
    Bus& bus = *bus_;
    for (const auto& device : bus.devices) {
        Device& d = *device;
        const bool startable =
            d.slave.present && d.identified && !d.refused && d.slave.configured >= 0;
        if (!startable || bus.target(d) != State::op) continue;
        bus.unsettle(d);
        // Nobody corrected the clocks meanwhile. On a broken ring their delays cannot be measured:
        // they drift back into the window.
        if (d.slave.number != bus.reference && !bus.status.ring_broken) {
            d.clock_set = false;
            d.synchronised = false;
        }
        if (d.helping) {
            continue;  // the supervision starts it once its channel is free
        }
        bus.run(d, [&] { return boot(d.channel, bus, d); });
    }
    bus.suspicious = true;
    bus.update_status();
}
void Master::set_boot(const BusSlave& slave, bool to_boot) noexcept {
    Device& d = *bus_->devices[slave.number];
    d.to_boot = to_boot && d.slave.configured < 0;
    bus_->run(d, [&] { return boot(d.channel, *bus_, d); });
}
void Master::set_outputs_valid(bool valid) noexcept { bus_->outputs_valid = valid; }

const Setup& Master::setup() const noexcept { return bus_->setup; }
const BusStatus& Master::status() const noexcept { return bus_->status; }
const DomainStatus& Master::domain(std::size_t n) const noexcept { return bus_->image.domain(n); }
std::uint64_t Master::cycles_incomplete() const noexcept {
    std::uint64_t sum = 0;
    for (std::size_t n = 0; n < bus_->image.domain_count(); ++n) {
        sum += bus_->image.domain(n).incomplete;
    }
    return sum;
}
void Master::reset_domain(std::size_t n) noexcept {
    DomainStatus& d = bus_->image.domain(n);
    d.was_complete = false;
    d.min = 0;
    d.changes = 0;
}
const SlaveStatus& Master::slave_status(std::size_t slave) const noexcept {
    const int device = bus_->device_of[slave];
    return device < 0 ? bus_->absent[slave]
                      : bus_->devices[static_cast<std::size_t>(device)]->status;
}

Master::Phase Master::dc_phase() const noexcept {
    const auto& sample = bus_->engine.clock();
    if (!sample.fresh || bus_->reference < 0) {
        return {};
    }
    const std::int64_t cycle = bus_->setup.cycle_ns;
    const std::int64_t phase =
        (static_cast<std::int64_t>(bus_->status.dc_time_ns) - sample.sent_after_ns) % cycle;
    return {true, phase > cycle / 2 ? phase - cycle : phase};
}

std::optional<std::int64_t> Master::first_sample_ns(std::size_t slave) const noexcept {
    const Slave& config = bus_->setup.slaves[slave];
    const int device = bus_->device_of[slave];
    if (!config.dc || device < 0 || !slave_status(slave).operational || !dc_phase().fresh) {
        return std::nullopt;
    }
    const std::int64_t cycle = bus_->setup.cycle_ns;
    const std::int64_t step = cycle / config.oversampling;
    const std::int64_t until_last = (config.oversampling - 1) * step;
    const std::int64_t shift = config.dc->sync0_shift_ns;
    const std::int64_t passed_ns = static_cast<std::int64_t>(bus_->status.dc_time_ns) +
                                   bus_->devices[static_cast<std::size_t>(device)]->slave.delay_ns;
    const std::int64_t first = (passed_ns - until_last - shift) / cycle * cycle + shift;
    return first - bus_->skew_ns;
}

std::size_t Master::found() const noexcept { return bus_->by_position.size(); }
BusSlave& Master::found(std::size_t position) noexcept {
    return bus_->devices[bus_->by_position[position]]->slave;
}
BusSlave* Master::numbered(std::uint16_t number) noexcept {
    return number < bus_->devices.size() && bus_->devices[number]->slave.present
               ? &bus_->devices[number]->slave
               : nullptr;
}
BusSlave* Master::slave(std::size_t slave) noexcept {
    const int device = bus_->device_of[slave];
    return device < 0 ? nullptr : &bus_->devices[static_cast<std::size_t>(device)]->slave;
}
Channel& Master::channel(const BusSlave& slave) noexcept {
    return bus_->devices[slave.number]->channel;
}
double Master::max_task_share() const noexcept { return bus_->engine.max_task_share(); }
bool Master::idle(const BusSlave& slave) const noexcept {
    return !bus_->devices[slave.number]->channel.busy();
}

}  // namespace hal::ethercat::master
