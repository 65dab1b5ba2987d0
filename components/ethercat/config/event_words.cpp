// SPDX-License-Identifier: MIT
#include "event_words.hpp"

#include <cstdio>

#include "ethercat/wire/al_status_codes.hpp"
#include "ethercat/wire/coe.hpp"

namespace hal::ethercat::config {

namespace {

using master::Event;
using master::Events;

std::string hex(std::int64_t value, int digits) {
    char text[24];
    std::snprintf(text, sizeof text, "0x%0*llX", digits, static_cast<unsigned long long>(value));
    return text;
}

/// Returns "0x6040:0" for index << 8 | sub.
std::string object_words(std::int64_t index_and_sub) { return hex(index_and_sub >> 8, 4) + ":" + std::to_string(index_and_sub & 0xff); }

std::string al_words(std::int64_t code) {
    const auto* row = al_status(static_cast<std::uint16_t>(code));
    std::string text = "AL status code " + hex(code, 4);
    if (row == nullptr) return text + "; see the manual of the drive";
    return text + " (" + row->text + "): " + row->cause + "; " + row->remedy;
}

std::string abort_words(std::int64_t code) {
    const auto number = static_cast<std::uint32_t>(code);
    if (number == 0) return "no answer from its mailbox";
    return "SDO abort " + hex(code, 8) + " (" + coe::abort_text(number) + ")";
}

std::string state_words(std::int64_t state) { return to_string(static_cast<State>(state & 0x0f)); }

std::string microseconds(std::int64_t ns) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g us", static_cast<double>(ns) * 1e-3);
    return text;
}

std::string identity_words(const char* what, std::int64_t found, std::int64_t expected, const char* key) {
    return std::string("has the ") + what + " " + hex(found, 8) + ", the configuration expects " + hex(expected, 8) +
           "; it stays in INIT: connect the right device, or correct `" + key + "`";
}

/// What happened to one slave; it follows the slave's name.
std::string of_slave(const Happened& w) {
    const auto first = w.first, second = w.second;
    switch (w.event) {
    case Event::slave_missing:
        return "is not on the bus; check its supply and cable, or write `optional = yes` in its section";
    case Event::unknown_slave:
        return "is not in the configuration (vendor " + hex(first, 8) + ", product " + hex(second, 8) + "); add it";
    case Event::wrong_vendor: return identity_words("vendor", first, second, "vendor");
    case Event::wrong_product: return identity_words("product code", first, second, "product");
    case Event::wrong_revision: return identity_words("revision", first, second, "revision");
    case Event::wrong_serial: return identity_words("serial number", first, second, "serial");
    case Event::duplicate_alias:
        return "has the alias " + std::to_string(first) + ", which the slave at position " + std::to_string(second) +
               " has too; give each its own";
    case Event::sii_failed:
        return "has an unreadable EEPROM (status " + hex(first, 4) + " at word " + hex(second, 2) + "); power-cycle it";
    case Event::no_mailbox: return "has no mailbox, but the configuration writes objects at start; remove its `sdo` lines";
    case Event::too_few_fmmus:
        return "has " + std::to_string(first) + " FMMUs, its process data needs " + std::to_string(second) + "; use fewer sync managers";
    case Event::too_few_sync_managers:
        return "has " + std::to_string(first) + " sync managers, the configuration needs " + std::to_string(second) + "; correct its PDOs";
    case Event::state_refused: return "rejects " + state_words(first) + " with " + al_words(second);
    case Event::state_timeout:
        return "did not reach " + state_words(first) + " in time; it is in " + state_words(second) + ": raise its time-out, or power-cycle it";
    case Event::fell_back: return "left its state by itself and is in " + state_words(first) + ", " + al_words(second);
    case Event::startup_write_failed: return "rejects the start-up write of " + object_words(first) + ": " + abort_words(second);
    case Event::mapping_failed: return "rejects the PDO mapping at " + object_words(first) + ": " + abort_words(second);
    case Event::mapping_differs:
        return "did not keep the PDO mapping: " + object_words(first) + " reads " + hex(second, 8) + "; this PDO is fixed, use its own entries";
    case Event::too_many_entries:
        return "does not take " + std::to_string(second) + " entries in PDO " + hex(first, 4) + "; spread them over several PDOs";
    case Event::fixed_size:
        return "has no mailbox to change its PDO mapping: sync manager " + std::to_string(first >> 16) + " has " + std::to_string(second) +
               (second == 1 ? " byte" : " bytes") + ", the configuration needs " + std::to_string(first & 0xffff) + "; list all of its own objects";
    case Event::slave_lost: return "does not answer; check its supply and the cable to it";
    case Event::slave_returned: return "answers again";
    case Event::slave_operational: return "is operational after " + std::to_string(second) + " ms";
    case Event::dc_unsupported: return "has no distributed clock, but the configuration has `dc`; remove that line";
    case Event::dc_timeout:
        return "deviates by " + microseconds(first) + " from the reference clock, more than the window of " + microseconds(second) +
               "; it is not started: check the cycle of the thread, or raise `sync-window`";
    case Event::ring_broken:
        return "is the last that the primary port reaches: the ring is broken behind it; all slaves still exchange data, repair the cable";
    case Event::start_up_failed:
        return "could not be started; it was in " + state_words(first) + " and is started again in " + std::to_string(second) + " s";
    case Event::reference_clock: return first != 0 ? "has the reference clock" : "has the reference clock (32 bits)";
    default: return {};
    }
}

/// What happened to the bus.
std::string of_bus(const Happened& w, const master::Setup& setup, const std::string& link, const std::string& backup) {
    const auto first = w.first, second = w.second;
    switch (w.event) {
    case Event::link_lost: return (first == 0 ? link : backup) + " has no link; check the cable to the first slave";
    case Event::link_restored: return (first == 0 ? link : backup) + " has a link again";
    case Event::no_slaves: return "no slave answers on " + link + "; check cable and supply of the first slave";
    case Event::scanned:
        if (first == second) return "found " + std::to_string(first) + (first == 1 ? " slave" : " slaves") + " on " + link;
        return "found " + std::to_string(first) + (first == 1 ? " slave" : " slaves") + " on " + link + ", the configuration has " + std::to_string(second);
    case Event::too_many_slaves:
        return "found " + std::to_string(first) + " slaves on " + link + ", more than the " + std::to_string(second) +
               " this master has space for; add them to the configuration";
    case Event::wkc_incomplete: {
        const auto domain = static_cast<std::size_t>(first >> 16);
        return "domain '" + (domain < setup.domains.size() ? setup.domains[domain].name : std::to_string(domain)) + "': working counter " +
               std::to_string(first & 0xffff) + " instead of " + std::to_string(second) +
               ((first & 0xffff) < second ? ": some slaves do not exchange process data" : ": a slave answers that is not started yet");
    }
    case Event::wkc_complete: {
        const auto domain = static_cast<std::size_t>(first >> 16);
        return "domain '" + (domain < setup.domains.size() ? setup.domains[domain].name : std::to_string(domain)) +
               "': every slave that is started exchanges process data";
    }
    case Event::dc_synchronised: return "all clocks are synchronised, largest deviation " + microseconds(first);
    case Event::ring_closed: return "the ring is closed again";
    case Event::topology_changed:
        return "the number of slaves on " + link + " changed from " + std::to_string(first) + " to " + std::to_string(second);
    default: return {};
    }
}

}  // namespace

std::string slave_words(std::uint32_t slave, const master::Setup& setup) {
    if (slave >= Events::of_position && slave != Events::bus) return "slave at position " + std::to_string(slave - Events::of_position);
    if (slave >= setup.slaves.size()) return "slave " + std::to_string(slave);
    const master::Slave& s = setup.slaves[slave];
    return "slave " + std::to_string(s.position) + (s.name.empty() ? "" : " (" + s.name + ")");
}

std::string event_words(const Happened& what, const master::Setup& setup, const std::string& link, const std::string& backup) {
    const std::string bus = of_bus(what, setup, link, backup);
    if (!bus.empty()) return bus;
    const std::string text = of_slave(what);
    return text.empty() ? text : slave_words(what.slave, setup) + " " + text;
}

}  // namespace hal::ethercat::config
