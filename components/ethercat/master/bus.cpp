// SPDX-License-Identifier: MIT
#include "ethercat/master/bus.hpp"

#include <algorithm>

namespace hal::ethercat::master {

Bus::Bus(Setup setup_, const std::array<std::uint8_t, 6>& source, Events& events_, CoeAccess& coe_)
    : setup(std::move(setup_)),
      image(setup, source),
      engine(image, status, setup),
      events(events_),
      coe(coe_),
      device_of(setup.slaves.size(), -1),
      absent(setup.slaves.size()),
      in_op(setup.slaves.size()),
      wkc_seen(image.domain_count(), WkcState::none) {
    constexpr std::size_t spare = 64;
    const std::size_t capacity =
        setup.max_slaves != 0 ? setup.max_slaves : setup.slaves.size() + spare;
    for (std::size_t n = 0; n < capacity; ++n) {
        devices.push_back(std::make_unique<Device>());
        devices[n]->slave.number = static_cast<std::uint16_t>(n);
        devices[n]->slave.station = static_cast<std::uint16_t>(first_station + n);
    }
    by_position.reserve(capacity);
    status.expected = static_cast<std::uint16_t>(std::count_if(
        setup.slaves.begin(), setup.slaves.end(), [](const Slave& s) { return !s.optional; }));
    for (const auto& d : devices) {
        engine.add(d->channel);
    }
    engine.add(watch_channel);
    engine.add(bus_channel);  // last: it sees what the others did in the same cycle
}

std::uint64_t Bus::dc_now() const noexcept {
    return reference >= 0 && status.dc_time_ns != 0
               ? status.dc_time_ns
               : static_cast<std::uint64_t>(engine.now_ns() + epoch_ns);
}

bool Bus::clocks_missing() const noexcept {
    if (reference < 0) {  // those that were found at first had no clock
        const auto wants = [](const Slave& s) { return s.dc.has_value(); };
        if (std::none_of(setup.slaves.begin(), setup.slaves.end(), wants)) return false;
    } else if (!devices[static_cast<std::size_t>(reference)]->slave.present) {
        return true;
    }
    return std::any_of(by_position.begin(), by_position.end(), [&](std::uint16_t n) {
        const Device& d = *devices[n];
        return d.slave.present && d.identified && d.slave.has_dc() && !d.clock_set;
    });
}

void Bus::leave(Device& d) noexcept {
    d.slave.present = false;
    d.slave.state = State::none;
    d.slave.mailbox_status = nullptr;
    d.status.online = d.status.al_error = false;
    unsettle(d);
    note_in_op(d, false);
    d.status.state = State::none;
    d.clock_set = d.synchronised = false;
    if (d.slave.configured < 0) return;
    const auto index = static_cast<std::size_t>(d.slave.configured);
    image.set_counting(index, false, false, false);
    image.clear_mailbox_status(index);
}

void Bus::note_in_op(const Device& d, bool is_in_op) noexcept {
    if (d.slave.configured < 0) return;
    const std::uint16_t station = is_in_op ? d.slave.station : std::uint16_t{0};
    in_op[static_cast<std::size_t>(d.slave.configured)].store(station, std::memory_order_relaxed);
}

void Bus::update_status() noexcept {
    State lowest = State::op;
    bool all = status.scanned;
    bool any = false;
    bool fresh = true;
    for (std::size_t n = 0; n < device_of.size(); ++n) {
        const Device* d =
            device_of[n] >= 0 ? devices[static_cast<std::size_t>(device_of[n])].get() : nullptr;
        if (d == nullptr || !d->slave.present) {
            all &= setup.slaves[n].optional;
            continue;
        }
        any = true;
        lowest = std::min(lowest, d->slave.state);
        all &= d->settled;
        fresh &= !d->stale;
    }
    status.state = any ? lowest : State::none;
    settled = all && any;
    status.operational = settled && fresh;
}

}  // namespace hal::ethercat::master
