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
constexpr unsigned max_categories = 64;
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

/// 0502h: wrong checksum, or not loaded; its application does not run
constexpr std::uint16_t eeprom_not_loaded = 0x1800;

/// Reads what the controller is, and the links of its ports.
Task<bool> read_controller(Channel& c, BusSlave& s) noexcept {
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
    co_return true;
}

/// Reads words of the SII, four at a time. Returns the last answer.
Task<SiiData> read_words(Channel& c, const BusSlave& s, std::uint16_t first,
                         std::span<std::uint16_t> to) noexcept {
    SiiData sii;
    for (std::size_t n = 0; n < to.size(); n += 4) {
        sii = co_await sii_read(c, s.station, static_cast<std::uint32_t>(first + n));
        if (!sii.ok) break;
        std::memcpy(to.data() + n, sii.words.data(), 8);
    }
    co_return sii;
}

/// Reports, once, that the EEPROM of a position cannot be read.
void report_unreadable(Bus& bus, std::uint16_t position, std::uint16_t control,
                       bool unloaded) noexcept {
    if (position >= bus.unreadable.size()) return;
    if (!bus.unreadable.test(position)) {
        bus.events.on_event(Event::sii_failed, Events::of_position + position, control,
                            unloaded ? 7 : 8);
    }
    bus.unreadable.set(position);
}

/// Reads vendor, product, revision and serial number.
Task<bool> read_identity(Channel& c, Bus& bus, BusSlave& s) noexcept {
    std::uint16_t words[8]{};
    const SiiData sii = co_await read_words(c, s, 0x08, words);
    const bool unloaded = sii.ok && (sii.control & eeprom_not_loaded) != 0;
    if (!sii.ok || unloaded) {
        report_unreadable(bus, s.position, sii.control, unloaded);
        co_return false;
    }
    if (s.position < bus.unreadable.size()) {
        bus.unreadable.reset(s.position);
    }
    std::memcpy(&s.vendor, words, 4);
    std::memcpy(&s.product, words + 2, 4);
    std::memcpy(&s.revision, words + 4, 4);
    std::memcpy(&s.serial, words + 6, 4);
    co_return true;
}

/// Reads where the mailboxes are, and their protocols.
Task<bool> read_mailboxes(Channel& c, BusSlave& s) noexcept {
    std::uint16_t words[12]{};
    const SiiData sii = co_await read_words(c, s, 0x14, words);
    if (!sii.ok) co_return false;
    s.bootstrap = {words[0], words[1], words[2], words[3]};
    s.mailbox = {words[4], words[5], words[6], words[7]};
    s.protocols = words[8];
    for (MailboxArea* area : {&s.mailbox, &s.bootstrap}) {
        // longer than a datagram, or an erased EEPROM
        if (area->out_size > Channel::max || area->in_size > Channel::max) {
            *area = {};
        }
    }
    co_return true;
}

/// Reads the category of the general properties at a word.
Task<bool> read_general(Channel& c, BusSlave& s, std::uint32_t at) noexcept {
    const SiiData sii = co_await sii_read(c, s.station, at + 4);
    if (!sii.ok) co_return false;
    s.coe_details = static_cast<std::uint8_t>(sii.words[0] >> 8);  // byte 5
    s.sii_flags = static_cast<std::uint8_t>(sii.words[3] >> 8);  // byte 11
    co_return true;
}

/// Reads the category of the sync managers at a word; `length` in words.
Task<bool> read_sync_managers(Channel& c, BusSlave& s, std::uint32_t at,
                              std::uint16_t length) noexcept {
    for (std::uint32_t word = 0; word + 4 <= length; word += 4) {
        if (s.sii_sync_managers >= BusSlave::max_sync_managers) break;
        const SiiData sii = co_await sii_read(c, s.station, at + 2 + word);
        if (!sii.ok) co_return false;
        const auto* bytes = reinterpret_cast<const std::uint8_t*>(sii.words.data());
        s.sii[s.sii_sync_managers++] = {sii.words[0], sii.words[1], bytes[4], bytes[6], bytes[7]};
    }
    co_return true;
}

/// Reads the categories that the master needs.
Task<bool> read_categories(Channel& c, BusSlave& s) noexcept {
    s.sii_sync_managers = 0;
    s.coe_details = 0;
    s.sii_flags = 0;
    bool general = false;
    bool managers = false;
    std::uint32_t at = 0x40;
    for (unsigned n = 0; n < max_categories && !(general && managers); ++n) {
        const SiiData sii = co_await sii_read(c, s.station, at);
        if (!sii.ok) co_return false;
        const std::uint16_t category = sii.words[0];
        const std::uint16_t length = sii.words[1];
        if (category == end_category || category == 0) break;
        bool good = true;
        if (category == general_category && length >= 6) {
            general = true;
            good = co_await read_general(c, s, at);
        } else if (category == sync_manager_category) {
            managers = true;
            good = co_await read_sync_managers(c, s, at, length);
        }
        if (!good) co_return false;
        at += 2U + length;
    }
    co_return true;
}

}  // namespace

Task<bool> identify(Channel& c, Bus& bus, BusSlave& s) noexcept {
    bool good = co_await read_controller(c, s);
    if (!good) co_return false;
    good = co_await read_identity(c, bus, s);
    if (!good) co_return false;
    good = co_await read_mailboxes(c, s);
    if (!good) co_return false;
    good = co_await read_categories(c, s);
    if (!good) co_return false;
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
    if (id.revision && !accepts(id.revision_rule, *id.revision, have.revision)) {
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

namespace {

/// Returns the slave at the place of a configured one; nullptr: it is missing. Where several are,
/// none of them is started.
Device* find_present(Bus& bus, std::size_t configured) noexcept {
    const Slave& want = bus.setup.slaves[configured];
    Device* found = nullptr;
    for (const std::uint16_t number : bus.by_position) {
        Device& d = *bus.devices[number];
        const bool is_free = d.slave.present && d.identified && d.slave.configured < 0;
        if (!is_free || !is_at_its_place(want, d.slave)) continue;
        if (found == nullptr) {
            found = &d;
            continue;
        }
        if (!d.refused) {
            const bool by_device_id = want.identity.device_id.has_value();
            bus.events.on_event(Event::duplicate_alias, static_cast<std::uint32_t>(configured),
                                by_device_id ? d.slave.device_id : d.slave.alias, d.slave.position);
        }
        d.refused = true;
        found->refused = true;
    }
    return found;
}

/// A slave that does not process LRW gets its process data by LRD and LWR.
void respect_lrw(Bus& bus, std::size_t configured, const BusSlave& slave) noexcept {
    constexpr std::uint16_t sii_no_lrw = 2;
    const bool has_lrw =
        (slave.features & registers::no_lrw) == 0 && (slave.sii_flags & sii_no_lrw) == 0;
    if (has_lrw || bus.image.slave(configured).no_lrw || !bus.engine.idle()) return;
    bus.image.set_no_lrw(configured);
    bus.image.build();
}

/// Makes a device the configured slave, if it is like it; an optional one need not be.
void assign(Bus& bus, std::size_t configured, Device& d) noexcept {
    const Slave& want = bus.setup.slaves[configured];
    d.slave.configured = static_cast<int>(configured);
    if (!matches(bus, want, d.slave, &d)) {
        if (want.optional) {
            d.slave.configured = -1;
            return;
        }
        d.refused = true;
    }
    d.slave.timeouts = want.timeouts;
    d.slave.complete_access = want.complete_access;
    d.slave.mailbox_status = nullptr;
    bus.device_of[configured] = d.slave.number;
    respect_lrw(bus, configured, d.slave);
}

}  // namespace

void assign(Bus& bus) noexcept {
    for (std::size_t n = 0; n < bus.setup.slaves.size(); ++n) {
        if (bus.device_of[n] >= 0) continue;
        const Slave& want = bus.setup.slaves[n];
        Device* const found = find_present(bus, n);
        if (found != nullptr) {
            assign(bus, n, *found);
        } else if (!want.optional) {
            bus.events.on_event(Event::slave_missing, static_cast<std::uint32_t>(n), want.position,
                                0);
        }
    }
    if (bus.setup.accept_other_slaves || bus.setup.slaves.empty()) return;
    for (const std::uint16_t number : bus.by_position) {
        Device& d = *bus.devices[number];
        const bool is_unknown = d.slave.present && d.identified && d.slave.configured < 0;
        if (is_unknown && !d.refused) {
            bus.unknown_reported = true;
            bus.report(Event::unknown_slave, d, d.slave.vendor, d.slave.product);
        }
    }
}

}  // namespace hal::ethercat::master
