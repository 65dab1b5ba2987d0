// SPDX-License-Identifier: MIT
#include "event_words.hpp"

#include <algorithm>
#include <cstdio>

#include "cia402/error_words.hpp"
#include "ethercat/wire/al_status_codes.hpp"
#include "ethercat/wire/coe.hpp"
#include "ethercat/wire/soe.hpp"
#include "link/ethernet.hpp"

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
std::string object_words(std::int64_t index_and_sub) {
    return hex(index_and_sub >> 8 & 0xffff, 4) + ":" + std::to_string(index_and_sub & 0xff);
}

std::string al_words(std::int64_t code) {
    const auto* row = al_status(static_cast<std::uint16_t>(code));
    std::string text = "AL status code " + hex(code, 4);
    if (code == 0) return "without an error code: another master asked for it, or the device did";
    if (row == nullptr) return text + "; see the manual of the drive";
    return text + " (" + row->text + "): " + row->cause + "; " + row->remedy;
}

std::string abort_words(std::int64_t code) {
    const auto number = static_cast<std::uint32_t>(code);
    if (number == 0) return "no answer from its mailbox";
    return "SDO abort " + hex(code, 8) + " (" + coe::abort_text(number) + ")";
}

std::string bytes_words(std::size_t bytes) {
    return std::to_string(bytes) + (bytes == 1 ? " byte" : " bytes");
}

/// Returns what the master wrote into the sync managers, where a state was rejected because of
/// them.
std::string configured_words(std::int64_t code, const master::Slave& slave) {
    if (code != 0x17 && code != 0x1d && code != 0x1e && code != 0x24 && code != 0x25) {
        return {};
    }
    std::string list;
    for (const auto& sm : slave.sync_managers) {
        std::size_t bits = 0;
        for (const auto& pdo : sm.pdos) {
            for (const auto& e : pdo.entries) {
                bits += e.bits;
            }
        }
        list += (list.empty() ? "" : " and ") + bytes_words((bits + 7) / 8) +
                (sm.output ? " of outputs" : " of inputs") + " in sync manager " +
                std::to_string(sm.number);
    }
    return ", which has " + (list.empty() ? "no process data" : list);
}

/// What was written at start: `sdo`, `idn` and `register` lines, commands of the description.
std::string write_words(std::int64_t object, std::int64_t code, const master::Slave& slave) {
    using Protocol = master::StartupWrite::Protocol;
    const auto at = std::find_if(slave.startup.begin(), slave.startup.end(),
                                 [&](const auto& w) { return (w.index << 8 | w.sub) == object; });
    if (at == slave.startup.end()) {
        return "rejects the start-up write of " + object_words(object) + ": " + abort_words(code);
    }
    std::string what = object_words(object);
    std::string why = abort_words(code);
    if (at->protocol == Protocol::soe) {
        what = std::string("IDN ") + (soe::is_product(at->index) ? "P-" : "S-") +
               std::to_string(soe::set_of(at->index)) + "-" +
               std::to_string(soe::number_of(at->index)) + " of drive " + std::to_string(at->sub);
        if (code != 0) {
            why = "SoE error " + hex(code, 4) + " (" +
                  soe::error_text(static_cast<std::uint16_t>(code)) + ")";
        }
    } else if (at->protocol == Protocol::aoe) {
        what += " by AoE" + (at->port != 0 ? ", port " + std::to_string(at->port) : std::string());
        if (code != 0 && std::string_view(coe::abort_text(static_cast<std::uint32_t>(code)))
                             .starts_with("unknown")) {
            why = "ADS error " + hex(code, 4);
        }
    } else if (at->protocol == Protocol::reg) {
        what = "register " + hex(at->index, 4);
        why = "it does not answer";
    }
    std::uint64_t number = 0;
    for (std::size_t n = std::min<std::size_t>(at->data.size(), 8); n-- > 0;) {
        number = number << 8 | at->data[n];
    }
    const std::string value =
        at->complete || at->data.size() > 8
            ? bytes_words(at->data.size())
            : hex(static_cast<std::int64_t>(number), static_cast<int>(2 * at->data.size()));
    return "rejects " + value + " for " + what + ": " + why + "; " +
           (at->line != 0
                ? "correct or delete line " + std::to_string(at->line) + " of the configuration"
                : "its description asks for it: check its `esi`");
}

/// A value that was written to a mapping (16xxh, 1Axxh) or an assignment (1C12h, 1C13h).
std::string mapped_words(std::int64_t value, std::int64_t object) {
    const std::int64_t index = object >> 8;
    if ((object & 0xff) == 0 && value == 0) {
        return index >= 0x1c10 ? "clearing the assignment" : "clearing the mapping";
    }
    if ((object & 0xff) == 0) {
        return std::to_string(value & 0xff) + (index >= 0x1c10 ? " PDOs" : " entries");
    }
    if (index >= 0x1c10) return "PDO " + hex(value & 0xffff, 4);
    return "object " + hex(value >> 16 & 0xffff, 4) + ":" + std::to_string(value >> 8 & 0xff) +
           " with " + std::to_string(value & 0xff) + " bits";
}

std::string rejected_mapping_words(std::int64_t first, std::int64_t code, bool lcec) {
    const std::int64_t value = first >> 24;
    const std::int64_t object = first & 0xff'ffff;
    const std::int64_t entry = object & 0xff;

    const std::int64_t index = object >> 8;
    std::string text = "rejects " + mapped_words(value, object) + " at " + object_words(object) +
                       ": " + abort_words(code);
    if (code == 0) return text + "; power-cycle it";
    const bool assignment = index >= 0x1c00;
    const bool input = index >= 0x1a00;
    if (lcec) {
        text += std::string("; correct its ") +
                (assignment ? "<syncManager>"
                 : input    ? "<syncManager dir=\"in\">"
                            : "<syncManager dir=\"out\">") +
                " or its <modParam>";
    } else {
        text += std::string("; correct `") +
                (assignment ? "outputs` or `inputs` or their `sync-manager"
                 : input    ? "inputs"
                            : "outputs") +
                "` in its section";
    }
    const auto number = static_cast<std::uint32_t>(code);
    // Slaves report a full PDO in several ways; few entries fit into any.
    const bool full =
        number == coe::abort::pdo_too_long ||
        (entry == 0 && (number == coe::abort::range || number == coe::abort::too_high)) ||
        (entry > 4 && number == coe::abort::no_sub);
    const std::int64_t fits = entry == 0 ? (value & 0xff) - 1 : entry - 1;
    if (full && !assignment && fits > 0) {
        text += ", or, if the PDO is full, write " +
                (lcec ? std::string("the modParam ") +
                            (input ? "ciaTxPDOEntryLimit" : "ciaRxPDOEntryLimit") + " value=\"" +
                            std::to_string(fits) + "\""
                      : "`entries-per-pdo = " + std::to_string(fits) + "`");
    }
    return text;
}

std::string state_words(std::int64_t state) { return to_string(static_cast<State>(state & 0x0f)); }

std::string microseconds(std::int64_t ns) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g us", static_cast<double>(ns) * 1e-3);
    return text;
}

std::string identity_words(const char* what, std::int64_t found, std::int64_t expected,
                           const char* key, const char* attribute = nullptr) {
    const std::string text = std::string("has the ") + what + " " + hex(found, 8) +
                             ", the configuration expects " + hex(expected, 8) +
                             "; it stays in INIT: connect the right device, or write ";
    if (attribute != nullptr) return text + attribute + "=\"" + hex(found, 8).substr(2) + "\"";
    return text + "`" + key + " = " + hex(found, 8) + "` or the `esi` of this device";
}

/// A cable, seen from one of the two slaves that it connects.
std::string cable_words(std::int64_t port_and_neighbour, const master::Setup& setup,
                        const std::string& link) {
    const auto other = static_cast<std::uint32_t>(port_and_neighbour >> 8);
    const std::string port = "port " + std::to_string(port_and_neighbour & 0xff);
    if (other == Events::nothing) return port + ", which is open now";
    return port + ": check the cable between there and " +
           (other == Events::bus ? link : slave_words(other, setup)) +
           ", its connectors and its shield";
}

std::string emergency_words(std::int64_t first, std::int64_t bytes) {
    std::string data;
    for (int n = 0; n < 5; ++n) {
        data += " " + hex(bytes >> 8 * n & 0xff, 2).substr(2);
    }
    const auto code = static_cast<std::uint16_t>(first & 0xffff);
    if (code == 0) return "reports that its errors are gone";
    return "reports emergency " + hex(code, 4) + " (" + canopen::cia402::error_word(code) +
           "), error register " + hex(first >> 16 & 0xff, 2) + ", data" + data +
           "; see the manual of the device";
}

/// What happened to one slave; it follows the slave's name.
std::string of_slave(const Happened& w, const master::Setup& setup, const std::string& link,
                     bool lcec) {
    static const master::Slave unnamed;
    const master::Slave& slave = w.slave < setup.slaves.size() ? setup.slaves[w.slave] : unnamed;
    const auto first = w.first;
    const auto second = w.second;
    switch (w.event) {
    case Event::slave_missing:
        return std::string("is not on the bus; check its supply and cable, or ") +
               (lcec ? "delete its <slave>" : "write `optional = yes` in its section");
    case Event::unknown_slave:
        if (lcec) {
            return "is not in the configuration (vendor " + hex(first, 8) + ", product " +
                   hex(second, 8) + "); add <slave idx=\"" +
                   std::to_string(w.slave - Events::of_position) + "\" type=\"generic\" vid=\"" +
                   hex(first, 8).substr(2) + "\" pid=\"" + hex(second, 8).substr(2) + "\"/>";
        }
        return "is not in the configuration (vendor " + hex(first, 8) + ", product " +
               hex(second, 8) + "); add [slave " + std::to_string(w.slave - Events::of_position) +
               " NAME], or write `other-slaves = accept` in [bus]";
    case Event::wrong_vendor:
        return identity_words("vendor", first, second, "vendor", lcec ? "vid" : nullptr);
    case Event::wrong_product:
        return identity_words("product code", first, second, "product", lcec ? "pid" : nullptr);
    case Event::wrong_revision: return identity_words("revision", first, second, "revision");
    case Event::wrong_serial: return identity_words("serial number", first, second, "serial");
    case Event::duplicate_alias:
        return "is not unique: the slave at position " + std::to_string(second) + " has the " +
               (slave.identity.device_id ? "device ID " : "alias ") + std::to_string(first) +
               " too; neither is started: give each its own, power-cycle both and load the master "
               "again";
    case Event::sii_failed:
        if ((first & 0x1800) != 0 && second == 7) {
            return "has an EEPROM with a wrong checksum (status " + hex(first, 4) +
                   "), so that its application does not run; write the contents anew with a tool "
                   "of its maker, then power-cycle it";
        }
        return "has an unreadable EEPROM (status " + hex(first, 4) + " at word " + hex(second, 2) +
               "); power-cycle it";
    case Event::no_mailbox:
        return "has no mailbox, but the configuration writes " + object_words(first) +
               " at start; delete its " +
               (lcec ? "<sdoConfig>, <idnConfig> and <initCmds>" : "`sdo` and `idn` lines");
    case Event::too_few_fmmus:
        return "has " + std::to_string(first) + " FMMUs, its process data needs " +
               std::to_string(second) + "; use fewer sync managers";
    case Event::too_few_sync_managers:
        return "has " + std::to_string(first) + (first == 1 ? " sync manager" : " sync managers") +
               ", the configuration needs " + std::to_string(second) + "; correct " +
               (lcec ? "idx of its <syncManager>"
                     : "`outputs.sync-manager` or `inputs.sync-manager` in its section") +
               ", which count from 0";
    case Event::state_refused:
        return "rejects " + state_words(first) + " with " + al_words(second) +
               configured_words(second, slave);
    case Event::state_timeout:
        return "did not reach " + state_words(first) + " in time; it is in " + state_words(second) +
               ": raise its time-out, or power-cycle it";
    case Event::fell_back:
        return "left its state and is in " + state_words(first) + ", " + al_words(second);
    case Event::startup_write_failed: return write_words(first, second, slave);
    case Event::no_eoe:
        return "has no Ethernet over EtherCAT, but the configuration has `eoe`; delete that line";
    case Event::eoe_failed:
        if (first == 0) {
            return "does not answer its IP settings; power-cycle it, or write `eoe = yes` to leave "
                   "them as they are";
        }
        return "rejects its IP settings with EoE result " + hex(first, 4) + " (" +
               eoe::to_string(static_cast<eoe::Result>(first)) +
               "); write `eoe = yes` to leave them as they are";
    case Event::mapping_failed: return rejected_mapping_words(first, second, lcec);
    case Event::mapping_differs:
        return "did not keep the PDO mapping: " + object_words(first) + " is " + hex(second, 8) +
               " instead of " + hex(first >> 24, 8) + "; this PDO is fixed: list its own entries";
    case Event::too_many_entries:
        return "does not take " + std::to_string(second) + " entries in PDO " + hex(first, 4) +
               "; spread them over several PDOs";
    case Event::fixed_size:
        return "has no mailbox to change its PDO mapping: sync manager " +
               std::to_string(first >> 16) + " has " + std::to_string(second) +
               (second == 1 ? " byte" : " bytes") + ", the configuration needs " +
               std::to_string(first & 0xffff) + "; list all of its own objects";
    case Event::slave_lost: return "does not answer; check its supply and the cable to it";
    case Event::slave_returned: return "answers again";
    case Event::slave_operational: return "is operational after " + std::to_string(second) + " ms";
    case Event::slave_settled:
        return "is in " + state_words(first) + ", the state of its configuration, after " +
               std::to_string(second) + " ms";
    case Event::dc_unsupported:
        return std::string("has no distributed clock, but the configuration has ") +
               (lcec ? "<dcConf>; delete it" : "`dc`; remove that line");
    case Event::dc_not_set:
        return "has a clock that could not be set within " + std::to_string(first) +
               " ms: its receive times were not readable, or the ring is broken; it is not "
               "started: check its cables, or " +
               (lcec ? "delete its <dcConf>" : "remove `dc`");
    case Event::dc_timeout:
        return "deviates by " + microseconds(first) +
               " from the reference clock, more than the window of " + microseconds(second) +
               "; it is not started: check the cycle of the thread" +
               (lcec ? "" : ", or raise `sync-window`");
    case Event::dc_recovered:
        return "has a clock within the window again, after " + std::to_string(second) + " ms";
    case Event::dc_lost:
        if (setup.dc_loss == master::DcLoss::safeop) {
            return "has a clock that deviates by " + microseconds(first) +
                   " from the reference clock, more than " + microseconds(second) +
                   "; it is taken to SAFE-OP until its clock is within the window again: check "
                   "that the thread misses no cycles";
        }
        return "is operational, but its clock deviates by " + microseconds(first) +
               " from the reference clock, more than " + microseconds(second) +
               "; check that the thread misses no cycles, and its manual for what it does without "
               "synchronisation";
    case Event::ring_broken:
        if (w.slave == Events::bus) {
            return {};
        }
        return "is the last that the primary port reaches: the ring is broken behind it; all "
               "slaves still exchange data, repair the cable";
    case Event::start_up_failed:
        return "could not be started; it was in " + state_words(first) +
               " and is started again in " + std::to_string(second) + " s";
    case Event::damaged_frames:
        return "received " + std::to_string(second) +
               (second == 1 ? " damaged frame" : " damaged frames") + " at " +
               cable_words(first, setup, link);
    case Event::emergency: return emergency_words(first, second);
    case Event::reference_clock:
        return first != 0 ? "has the reference clock" : "has the reference clock (32 bits)";
    default: return {};
    }
}

/// What happened to the bus.
std::string of_bus(const Happened& w, const master::Setup& setup, const std::string& link,
                   const std::string& backup) {
    const auto first = w.first;
    const auto second = w.second;
    switch (w.event) {
    case Event::link_lost: return no_link_words(first == 0 ? link : backup);
    case Event::link_restored: return (first == 0 ? link : backup) + " has a link again";
    case Event::no_slaves:
        return "no slave answers on " + link + "; check " +
               (ethernet::describe(link).datagrams
                    ? "the address, and that a line of slaves is served there"
                    : "cable and supply of the first slave");
    case Event::scanned:
        // others name what is missing
        return "found " + std::to_string(first) + (first == 1 ? " slave" : " slaves") + " on " +
               link;
    case Event::too_many_slaves:
        return "found " + std::to_string(first) + " slaves on " + link + ", more than the " +
               std::to_string(second) +
               " this master has space for; add the others to the configuration";
    case Event::wkc_incomplete: {
        const auto domain = static_cast<std::size_t>(first >> 16);
        return "domain '" +
               (domain < setup.domains.size() ? setup.domains[domain].name
                                              : std::to_string(domain)) +
               "': working counter " + std::to_string(first & 0xffff) + " instead of " +
               std::to_string(second) +
               ((first & 0xffff) < second ? ": some slaves do not exchange process data"
                                          : ": a slave answers that is not started yet");
    }
    case Event::wkc_complete: {
        const auto domain = static_cast<std::size_t>(first >> 16);
        return "domain '" +
               (domain < setup.domains.size() ? setup.domains[domain].name
                                              : std::to_string(domain)) +
               "': every slave that is started exchanges process data";
    }
    case Event::dc_synchronised:
        return "all clocks are synchronised, largest deviation " + microseconds(first);
    case Event::ring_broken:
        if (w.slave != Events::bus) {
            return {};
        }
        return link +
               " reaches no slave: the ring is broken there; all slaves still exchange data, "
               "repair the cable";
    case Event::ring_closed: return "the ring is closed again";
    case Event::other_master:
        return "another EtherCAT master sends on " + link + " (" + std::to_string(first) +
               " of its frames in a second): stop it, or give each master its own link";
    case Event::topology_changed:
        return "the number of slaves on " + link + " changed from " + std::to_string(first) +
               " to " + std::to_string(second);
    default: return {};
    }
}

}  // namespace

MessageSubject subject(const Happened& what) {
    const bool by_position = what.slave >= Events::of_position && what.slave != Events::bus;
    MessageSubject of{std::to_string(static_cast<int>(what.event))};
    (by_position ? of.detail : of.kind) += " " + std::to_string(what.slave);
    switch (what.event) {
    case Event::emergency: of.detail += " " + std::to_string(what.first & 0xffff); break;
    case Event::fell_back:
    case Event::state_refused:
    case Event::startup_write_failed:
    case Event::mapping_failed:
    case Event::eoe_failed:
        of.detail += " " + std::to_string(what.first) + " " + std::to_string(what.second);
        break;
    default: break;  // what else differs was measured or counted
    }
    return of;
}

std::string no_link_words(const std::string& link) {
    if (!ethernet::describe(link).datagrams) {
        return link + " has no link; check the cable to the first slave";
    }
    return link +
           " has no link: no program listens there; emulate a line, as in: hal node ethercat FILE "
           "--link " +
           link;
}

std::string recorded_words(const std::string& link) {
    return link +
           " is a capture, whose slaves do not answer; to see what is in it: hal ethercat dump "
           "FILE";
}

std::string slave_words(std::uint32_t slave, const master::Setup& setup) {
    if (slave >= Events::of_position && slave != Events::bus) {
        return "slave at position " + std::to_string(slave - Events::of_position);
    }
    if (slave >= setup.slaves.size()) return "slave " + std::to_string(slave);
    const master::Slave& s = setup.slaves[slave];
    const std::string where = s.identity.device_id ? "id=" + std::to_string(*s.identity.device_id)
                              : s.identity.alias   ? "alias=" + std::to_string(*s.identity.alias)
                                                   : std::to_string(s.position);
    return "slave " + where + (s.name.empty() ? "" : " (" + s.name + ")");
}

std::string event_words(const Happened& what, const master::Setup& setup, const std::string& link,
                        const std::string& backup, Format format) {
    const std::string bus = of_bus(what, setup, link, backup);
    if (!bus.empty()) return bus;
    const std::string text = of_slave(what, setup, link, format == Format::lcec);
    return text.empty() ? text : slave_words(what.slave, setup) + " " + text;
}

}  // namespace hal::ethercat::config
