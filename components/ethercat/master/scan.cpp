// SPDX-License-Identifier: MIT
// Finding the slaves: count, clear, address, read registers and SII, of all slaves at once.
#include <algorithm>

#include "ethercat/master/bus.hpp"
#include "ethercat/master/sii_access.hpp"
#include "ethercat/master/topology.hpp"

namespace hal::ethercat::master {

namespace {

enum Category : std::uint16_t {
    general_category = 30,
    sync_manager_category = 41,
    end_category = 0xffff
};
constexpr unsigned most_categories = 64;
constexpr std::int64_t device_id_timeout_ns = 100 * millisecond;

/// Explicit device identification: AL control with bit 5, the number appears in the AL status code.
Task<void> read_device_id(Channel& c, BusSlave& s) noexcept {
    Answer a = co_await read(c, s, registers::al_status, 2);
    if (a.wkc != 1) co_return;
    const auto state = static_cast<std::uint16_t>(get<std::uint16_t>(c.data()) & 0x0f);
    co_await write(c, s, registers::al_control, static_cast<std::uint16_t>(state | al_identify));
    const std::int64_t until = c.now_ns() + device_id_timeout_ns;
    while (c.now_ns() < until) {
        a = co_await read(c, s, registers::al_status, 6);
        if (a.wkc != 1 || (get<std::uint16_t>(c.data()) & al_identify) == 0) continue;
        s.device_id = get<std::uint16_t>(c.data() + 4);
        break;
    }
    co_await write(c, s, registers::al_control, state);
}

}  // namespace

/// 0502h: wrong checksum, or not loaded; its application does not run
constexpr std::uint16_t eeprom_not_loaded = 0x1800;

Task<bool> identify(Channel& c, Bus& bus, BusSlave& s) noexcept {
    Answer a = co_await read(c, s, registers::type, 10);
    if (a.wkc != 1) co_return false;
    s.fmmus = c.data()[4];
    s.sync_managers = c.data()[5];
    s.port_descriptor = c.data()[7];
    s.features = get<std::uint16_t>(c.data() + 8);
    a = co_await read(c, s, registers::station_alias, 2);
    if (a.wkc == 1) {
        s.alias = get<std::uint16_t>(c.data());
    }
    a = co_await read(c, s, registers::dl_status, 2);
    if (a.wkc != 1) co_return false;
    s.dl_status = get<std::uint16_t>(c.data());

    std::uint16_t words[12]{};
    SiiData sii;
    for (std::uint16_t word = 8; word < 0x10; word = static_cast<std::uint16_t>(word + 4)) {
        sii = co_await sii_read(c, s.station, word);
        if (!sii.ok) break;
        std::memcpy(words + (word - 8), sii.words.data(), 8);
    }
    const bool unloaded = sii.ok && (sii.control & eeprom_not_loaded) != 0;
    if (!sii.ok || unloaded) {
        if (s.position < bus.unreadable.size() && !bus.unreadable.test(s.position)) {
            bus.events.report(Event::sii_failed, Events::of_position + s.position, sii.control,
                              unloaded ? 7 : 8);
        }
        if (s.position < bus.unreadable.size()) {
            bus.unreadable.set(s.position);
        }
        co_return false;
    }
    if (s.position < bus.unreadable.size()) {
        bus.unreadable.reset(s.position);
    }
    std::memcpy(&s.vendor, words, 4);
    std::memcpy(&s.product, words + 2, 4);

    std::memcpy(&s.revision, words + 4, 4);
    std::memcpy(&s.serial, words + 6, 4);
    for (std::uint16_t word = 0x14; word < 0x20; word = static_cast<std::uint16_t>(word + 4)) {
        sii = co_await sii_read(c, s.station, word);
        if (!sii.ok) co_return false;
        std::memcpy(words + (word - 0x14), sii.words.data(), 8);
    }
    s.bootstrap = {words[0], words[1], words[2], words[3]};
    s.mailbox = {words[4], words[5], words[6], words[7]};
    s.protocols = words[8];
    for (const MailboxArea* area :
         {&s.mailbox, &s.bootstrap}) {  // longer than a datagram, or an erased EEPROM
        if (area->out_size > Channel::largest || area->in_size > Channel::largest) {
            (area == &s.mailbox ? s.mailbox : s.bootstrap) = {};
        }
    }

    s.sii_sync_managers = 0;
    s.coe_details = 0;
    s.sii_flags = 0;
    bool general = false;
    bool managers = false;
    std::uint32_t at = 0x40;
    for (unsigned n = 0; n < most_categories && !(general && managers); ++n) {
        sii = co_await sii_read(c, s.station, at);
        if (!sii.ok) co_return false;
        const std::uint16_t category = sii.words[0];
        const std::uint16_t length = sii.words[1];
        if (category == end_category || category == 0) break;
        if (category == general_category && length >= 6) {
            general = true;
            sii = co_await sii_read(c, s.station, at + 4);
            if (!sii.ok) co_return false;
            s.coe_details = static_cast<std::uint8_t>(sii.words[0] >> 8);  // byte 5
            s.sii_flags = static_cast<std::uint8_t>(sii.words[3] >> 8);  // byte 11
        } else if (category == sync_manager_category) {
            managers = true;
            for (std::uint32_t word = 0;
                 word + 4 <= length && s.sii_sync_managers < BusSlave::most_sync_managers;
                 word += 4) {
                sii = co_await sii_read(c, s.station, at + 2 + word);
                if (!sii.ok) co_return false;
                const auto* bytes = reinterpret_cast<const std::uint8_t*>(sii.words.data());
                s.sii[s.sii_sync_managers++] = {sii.words[0], sii.words[1], bytes[4], bytes[6],
                                                bytes[7]};
            }
        }
        at += 2U + length;
    }
    s.device_id = 0;
    const auto wants = [](const Slave& slave) { return slave.identity.device_id.has_value(); };
    if (std::any_of(bus.setup.slaves.begin(), bus.setup.slaves.end(), wants)) {
        co_await read_device_id(c, s);
    }
    co_return true;
}

Task<void> scan_one(Channel& c, Bus& bus, Device& d) noexcept {
    d.identified = false;
    put(c.data(), d.slave.station);
    const Answer a = co_await c.exchange(
        Command::apwr, at_position(d.slave.position, registers::station_address), 2);
    if (a.wkc != 1) co_return;
    d.identified = co_await identify(c, bus, d.slave);
    if (!d.identified) {
        co_return;  // supervise() tries it again
    }
    d.slave.present = d.status.online = true;
    co_await read_state(c, bus, d);
}

Task<bool> scan(Channel& c, Bus& bus) noexcept {
    bus.engine.use_backup(false);
    bus.exchange = false;
    bus.status.scanned = false;
    for (const auto& d : bus.devices) {
        d->channel.stop();
        bus.leave(*d);
        d->slave.configured = -1;
        d->slave.position = BusSlave::nowhere;
        d->identified = d->refused = d->clock_set = d->synchronised = false;
    }
    std::fill(bus.device_of.begin(), bus.device_of.end(), -1);
    bus.unreadable.reset();
    c.data()[0] = 0;
    Answer a = co_await c.exchange(Command::brd, at_position(0, registers::type), 1);
    bus.status.responding = a.arrived ? a.wkc : std::uint16_t{0};
    if (!a.arrived || a.wkc == 0) {
        if (!bus.reported_empty && bus.status.link) {
            bus.report(Event::no_slaves);
        }
        bus.reported_empty = bus.reported_empty || bus.status.link;
        co_return false;
    }
    bus.reported_empty = false;
    bus.known = a.wkc;
    if (bus.known > bus.devices.size()) {
        if (std::exchange(bus.reported_many, bus.known) != bus.known) {
            bus.report(Event::too_many_slaves, bus.known,
                       static_cast<std::int64_t>(bus.devices.size()));
        }
        co_return false;
    }
    bus.reported_many = 0;
    co_await write_all<std::uint8_t>(c, registers::loop_control, 0);
    co_await write_all<std::uint8_t>(c, registers::dl_alias_enable, 0);
    co_await clear_all(c, registers::rx_errors, 20);
    co_await clear_all(c, registers::fmmu, 256);
    co_await clear_all(c, registers::sync_manager, 128);
    co_await write_all<std::uint8_t>(c, registers::dc_activation, 0);
    co_await write_all<std::uint64_t>(c, registers::dc_system_time, 0);
    co_await write_all<std::uint16_t>(c, registers::dc_speed_counter_start, 0x1000);
    co_await write_all<std::uint16_t>(c, registers::dc_filter_depth, 0x0c00);
    co_await write_all<std::uint16_t>(c, registers::al_control,
                                      static_cast<std::uint16_t>(State::init) | al_error);
    co_await write_all<std::uint8_t>(c, registers::eeprom_configuration, 2);
    co_await write_all<std::uint8_t>(c, registers::eeprom_configuration, 0);

    bus.by_position.clear();
    for (unsigned n = 0; n < bus.known; ++n) {
        Device& d = *bus.devices[n];
        d.slave.position = static_cast<std::uint16_t>(n);
        bus.by_position.push_back(static_cast<std::uint16_t>(n));
        bus.run(d, [&] { return scan_one(d.channel, bus, d); });
    }
    const auto working = [&] {
        return std::any_of(bus.by_position.begin(), bus.by_position.end(),
                           [&](std::uint16_t n) { return bus.devices[n]->channel.busy(); });
    };
    while (working()) {
        co_await c.sleep(0);
    }

    assign(bus);
    bus.engine.use_backup(true);
    bus.status.scanned = true;
    bus.report(Event::scanned, bus.known, bus.status.expected);
    co_return true;
}

bool matches(Bus& bus, const Slave& want, const BusSlave& have, Device* to_report) noexcept {
    const Identity& id = want.identity;
    const auto fail = [&](Event event, std::uint32_t found, std::uint32_t expected) {
        if (to_report != nullptr) {
            bus.report(event, *to_report, found, expected);
        }
        return false;
    };
    if (id.vendor != 0 && have.vendor != id.vendor) {
        return fail(Event::wrong_vendor, have.vendor, id.vendor);
    }
    if (id.product != 0 && have.product != id.product) {
        return fail(Event::wrong_product, have.product, id.product);
    }
    if (id.revision && have.revision != *id.revision &&
        !(id.revision_or_higher && have.revision > *id.revision)) {
        return fail(Event::wrong_revision, have.revision, *id.revision);
    }
    if (id.serial && have.serial != *id.serial) {
        return fail(Event::wrong_serial, have.serial, *id.serial);
    }
    return true;
}

bool is_at_its_place(const Slave& want, const BusSlave& have) noexcept {
    if (want.identity.device_id) return have.device_id == *want.identity.device_id;
    return want.identity.alias ? have.alias == *want.identity.alias
                               : have.position == want.position;
}

void assign(Bus& bus) noexcept {
    for (std::size_t n = 0; n < bus.setup.slaves.size(); ++n) {
        if (bus.device_of[n] >= 0) continue;
        const Slave& want = bus.setup.slaves[n];
        Device* found = nullptr;
        for (const std::uint16_t number : bus.by_position) {
            Device& d = *bus.devices[number];
            if (!d.slave.present || !d.identified || d.slave.configured >= 0) continue;
            if (!is_at_its_place(want, d.slave)) continue;
            if (found == nullptr) {
                found = &d;
                continue;
            }
            if (!d.refused) {
                bus.events.report(Event::duplicate_alias, static_cast<std::uint32_t>(n),
                                  want.identity.device_id ? d.slave.device_id : d.slave.alias,
                                  d.slave.position);
            }
            d.refused = found->refused = true;  // ambiguous: neither is started
        }
        if (found == nullptr) {
            if (!want.optional) {
                bus.events.report(Event::slave_missing, static_cast<std::uint32_t>(n),
                                  want.position, 0);
            }
            continue;
        }
        Device& d = *found;
        d.slave.configured = static_cast<int>(n);
        if (!matches(bus, want, d.slave, &d)) {
            if (want.optional) {
                d.slave.configured = -1;
                continue;
            }
            d.refused = true;
        }
        d.slave.timeouts = want.timeouts;
        d.slave.complete_access = want.complete_access;
        d.slave.mailbox_status = nullptr;
        bus.device_of[n] = d.slave.number;
        if (((d.slave.features & registers::no_lrw) != 0 || (d.slave.sii_flags & 2) != 0) &&
            !bus.image.slave(n).no_lrw && bus.engine.idle()) {
            bus.image.set_no_lrw(n);
            bus.image.build();
        }
    }
    for (const std::uint16_t number : bus.by_position) {
        Device& d = *bus.devices[number];
        if (d.slave.present && d.identified && d.slave.configured < 0 && !d.refused &&
            !bus.setup.accept_other_slaves && !bus.setup.slaves.empty()) {
            bus.report(Event::unknown_slave, d, d.slave.vendor, d.slave.product);
        }
    }
}

}  // namespace hal::ethercat::master
