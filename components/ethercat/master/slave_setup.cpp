// SPDX-License-Identifier: MIT
// Settings of a slave's controller: sync managers, FMMUs, watchdogs, and the writes that the setup
// asks for.
#include "ethercat/master/bus.hpp"

namespace hal::ethercat::master {

namespace {

constexpr std::uint8_t mailbox_out_control = 0x26;
constexpr std::uint8_t mailbox_in_control = 0x22;

constexpr std::uint8_t outputs_control = 0x64;
constexpr std::uint8_t outputs_unwatched = 0x24;
constexpr std::uint8_t inputs_control = 0x20;
constexpr std::uint8_t fmmu_reads = 1;
constexpr std::uint8_t fmmu_writes = 2;

void put_sync_manager(std::uint8_t* to, std::uint16_t start, std::uint16_t length,
                      std::uint8_t control) noexcept {
    put(to, start);
    put(to + 2, length);
    to[4] = control;
    to[5] = 0;
    to[6] = length != 0 ? 1 : 0;
    to[7] = 0;
}

void put_fmmu(std::uint8_t* to, std::uint32_t logical, std::uint16_t length, std::uint16_t physical,
              std::uint8_t type) noexcept {
    std::memset(to, 0, 16);
    put(to, logical);
    put(to + 4, length);
    to[6] = 0;
    to[7] = 7;
    put(to + 8, physical);
    to[11] = type;
    to[12] = 1;
}

/// Physical start of a sync manager: of the setup, else of the SII.
std::uint16_t start_of(const SyncManager& sm, const BusSlave& s) noexcept {
    if (sm.start != 0) return sm.start;
    if (sm.number < s.sii_sync_managers) return s.sii[sm.number].start;
    return std::uint16_t{0};
}

/// Returns the control byte of a sync manager of process data.
std::uint8_t control_of(const SyncManager& sm) noexcept {
    if (sm.control != 0) return sm.control;
    if (!sm.output) return inputs_control;
    return sm.watchdog ? outputs_control : outputs_unwatched;
}

}  // namespace

Task<bool> clear_settings(Channel& c, Bus& bus, Device& d) noexcept {
    const Slave* config = bus.config(d);
    if (config != nullptr) {
        bus.image.set_counting(static_cast<std::size_t>(d.slave.configured), false, false, false);
    }
    if (d.slave.has_dc()) {
        co_await write<std::uint8_t>(c, d.slave, registers::dc_activation, 0);
    }
    const auto fmmus = static_cast<std::uint16_t>(16 * std::min<unsigned>(d.slave.fmmus, 16));
    std::memset(c.data(), 0, 256);
    Answer a =
        co_await c.exchange(Command::fpwr, at_station(d.slave.station, registers::fmmu), fmmus);
    if (fmmus != 0 && a.wkc != 1) co_return false;
    const auto managers =
        static_cast<std::uint16_t>(8 * std::min<unsigned>(d.slave.sync_managers, 16));
    std::memset(c.data(), 0, 128);
    a = co_await c.exchange(Command::fpwr, at_station(d.slave.station, registers::sync_manager),
                            managers);
    co_return managers == 0 || a.wkc == 1;
}

Task<void> clear_process_data(Channel& c, Bus& bus, Device& d) noexcept {
    if (bus.config(d) == nullptr) co_return;
    const auto fmmus = static_cast<std::uint16_t>(16 * std::min<unsigned>(d.slave.fmmus, 16));
    d.slave.mailbox_status = nullptr;
    bus.image.clear_mailbox_status(static_cast<std::size_t>(d.slave.configured));
    std::memset(c.data(), 0, 256);
    co_await c.exchange(Command::fpwr, at_station(d.slave.station, registers::fmmu), fmmus);
    co_await c.sleep(0);  // a frame with process data may have passed before
    bus.image.set_counting(static_cast<std::size_t>(d.slave.configured), false, false, false);
}

Task<bool> set_mailbox(Channel& c, Bus& bus, Device& d) noexcept {
    const MailboxArea& m = d.slave.area();
    d.slave.mailbox_status = nullptr;  // the FMMU that carried it is cleared
    if (!m.usable()) co_return true;
    put_sync_manager(c.data(), m.out_start, m.out_size, mailbox_out_control);
    put_sync_manager(c.data() + 8, m.in_start, m.in_size, mailbox_in_control);
    const Answer a = co_await c.exchange(Command::fpwr,
                                         at_station(d.slave.station, registers::sync_manager), 16);
    // the slave counts from 1 again, and answers nothing that was requested before
    d.slave.mailbox_counter = 0;
    bus.coe.reset_mailbox(d.slave);
    co_return a.wkc == 1;
}

Task<bool> set_process_data(Channel& c, Bus& bus, Device& d) noexcept {
    const Slave& config = *bus.config(d);
    const auto index = static_cast<std::size_t>(d.slave.configured);
    const auto& image = bus.image.slave(index);
    unsigned fmmu = 0;
    bool writes = false;
    bool reads = false;
    Answer a;
    if (config.watchdog.divider) {
        co_await write(c, d.slave, registers::watchdog_divider, *config.watchdog.divider);
    }
    if (config.watchdog.intervals) {
        co_await write(c, d.slave, registers::process_data_watchdog, *config.watchdog.intervals);
    }
    for (std::size_t n = 0; n < config.sync_managers.size(); ++n) {
        const SyncManager& sm = config.sync_managers[n];
        const auto bytes = static_cast<std::uint16_t>(image.areas[n].bytes);
        if (sm.number >= d.slave.sync_managers) {
            bus.report(Event::too_few_sync_managers, d, d.slave.sync_managers, sm.number + 1);
            co_return false;
        }
        put_sync_manager(c.data(), start_of(sm, d.slave), bytes, control_of(sm));
        a = co_await c.exchange(
            Command::fpwr, at_station(d.slave.station, registers::sync_manager_at(sm.number)), 8);
        if (a.wkc != 1) co_return false;
        (sm.output ? writes : reads) |= bytes != 0;
    }
    const bool status = image.mailbox_status_at >= 0 && d.slave.mailbox.usable();
    unsigned needed = 0;
    for (const auto& area : image.areas) {
        needed += area.bytes != 0 ? 1 : 0;
    }
    if (needed > d.slave.fmmus) {
        bus.report(Event::too_few_fmmus, d, d.slave.fmmus, needed);
        co_return false;
    }
    const bool map_status = status && needed < d.slave.fmmus;
    bus.image.set_counting(index, writes, reads || map_status, true);
    for (std::size_t n = 0; n < config.sync_managers.size(); ++n) {
        const auto& area = image.areas[n];
        if (area.bytes == 0) continue;
        put_fmmu(c.data(), area.at, static_cast<std::uint16_t>(area.bytes),
                 start_of(config.sync_managers[n], d.slave),
                 area.output ? fmmu_writes : fmmu_reads);
        a = co_await c.exchange(Command::fpwr,
                                at_station(d.slave.station, registers::fmmu_at(fmmu++)), 16);
        if (a.wkc != 1) co_return false;
    }
    d.slave.mailbox_status = nullptr;
    if (map_status) {
        constexpr std::uint16_t mailbox_in_status = registers::sync_manager_at(1) + 5;
        put_fmmu(c.data(), static_cast<std::uint32_t>(image.mailbox_status_at), 1,
                 mailbox_in_status, fmmu_reads);
        a = co_await c.exchange(Command::fpwr,
                                at_station(d.slave.station, registers::fmmu_at(fmmu++)), 16);
        if (a.wkc != 1) co_return false;
        d.slave.mailbox_status = bus.image.mailbox_status(index);
    }
    co_return true;
}

static Task<bool> set_ip(Channel& c, Bus& bus, Device& d, const Slave& config) noexcept {
    if (!d.slave.mailbox.usable() || (d.slave.protocols & bit_of(MailboxType::eoe)) == 0) {
        bus.report(Event::no_eoe, d, d.slave.protocols);
        co_return false;
    }
    if (!config.eoe_ip) co_return true;
    const SdoResult r = co_await bus.coe.set_ip(c, d.slave, *config.eoe_ip);
    if (!r) {
        bus.report(Event::eoe_failed, d, r.abort);
    }
    co_return bool(r);
}

Task<bool> startup_writes(Channel& c, Bus& bus, Device& d, State before) noexcept {
    const Slave* config = bus.config(d);
    if (config == nullptr) co_return true;
    if (config->eoe && before == State::safeop) {
        const bool ok = co_await set_ip(c, bus, d, *config);
        if (!ok) co_return false;
    }
    for (const StartupWrite& w : config->startup) {
        if (w.before != before) continue;
        const std::int64_t object = w.index << 8 | w.sub;
        if (w.protocol == StartupWrite::Protocol::reg) {
            if (w.data.size() > Channel::max) continue;
            std::memcpy(c.data(), w.data.data(), w.data.size());
            const Answer a =
                co_await c.exchange(Command::fpwr, at_station(d.slave.station, w.index),
                                    static_cast<std::uint16_t>(w.data.size()));
            if (a.wkc == 1) continue;
            bus.report(Event::startup_write_failed, d, object, 0);
            co_return false;
        }
        if (!d.slave.mailbox.usable()) {
            bus.report(Event::no_mailbox, d, object);
            co_return false;
        }
        SdoResult r;
        if (w.protocol == StartupWrite::Protocol::coe) {
            r = co_await bus.coe.download(c, d.slave, w.index, w.sub, w.complete, w.data);
        } else {
            r = co_await bus.coe.write_other(c, d.slave, w);
        }
        if (r) continue;
        bus.report(Event::startup_write_failed, d, object, event_code(r));
        co_return false;
    }
    co_return true;
}

}  // namespace hal::ethercat::master
