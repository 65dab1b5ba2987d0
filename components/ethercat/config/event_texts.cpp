// SPDX-License-Identifier: MIT
#include "event_texts.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <iterator>
#include <string_view>

#include "cia402/error_words.hpp"
#include "ethercat/wire/al_status_codes.hpp"
#include "ethercat/wire/coe.hpp"
#include "ethercat/wire/soe.hpp"
#include "link/ethernet.hpp"
#include "text/quoting.hpp"

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
    if ((code & master::mailbox_error_flag) != 0) {
        return "mailbox error " + hex(number, 4) + " (" +
               to_string(static_cast<MailboxError>(number)) + ")";
    }
    if (number == 0) return "no answer from its mailbox";
    return "SDO abort " + hex(code, 8) + " (" + coe::abort_text(number) + ")";
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
        list += (list.empty() ? "" : " and ") + counted((bits + 7) / 8, "byte") +
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
    const bool is_mailbox_error = (code & master::mailbox_error_flag) != 0;
    if (at->protocol == Protocol::soe) {
        what = std::string("IDN ") + (soe::is_product(at->index) ? "P-" : "S-") +
               std::to_string(soe::set_of(at->index)) + "-" +
               std::to_string(soe::number_of(at->index)) + " of drive " + std::to_string(at->sub);
        if (code != 0 && !is_mailbox_error) {
            why = "SoE error " + hex(code, 4) + " (" +
                  soe::error_text(static_cast<std::uint16_t>(code)) + ")";
        }
    } else if (at->protocol == Protocol::aoe) {
        what += " by AoE" + (at->port != 0 ? ", port " + std::to_string(at->port) : std::string());
        if (code != 0 && !is_mailbox_error &&
            std::string_view(coe::abort_text(static_cast<std::uint32_t>(code)))
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
            ? counted(at->data.size(), "byte")
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
    std::string element = input ? "<syncManager dir=\"in\">" : "<syncManager dir=\"out\">";
    std::string key = input ? "inputs" : "outputs";
    if (assignment) {
        element = "<syncManager>";
        key = "outputs` or `inputs` or their `sync-manager";
    }
    if (lcec) {
        text += "; correct its " + element + " or its <modParam>";
    } else {
        text += "; correct `" + key + "` in its section";
    }
    const auto number = static_cast<std::uint32_t>(code);
    // Slaves report a full PDO in several ways; few entries fit into any.
    const bool full = number == code_of(coe::Abort::pdo_length) ||
                      (entry == 0 && (number == code_of(coe::Abort::value) ||
                                      number == code_of(coe::Abort::too_high))) ||
                      (entry > 4 && number == code_of(coe::Abort::no_sub));
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

/// Three digits, and all of them before the point.
std::string microseconds(std::int64_t ns) {
    constexpr std::int64_t whole_above_ns = 999'500;
    char text[32];
    const double us = static_cast<double>(ns) * 1e-3;
    std::snprintf(text, sizeof text, ns < whole_above_ns ? "%.3g us" : "%.0f us", us);
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

/// Why a link has no carrier, and what to do; it follows "has no link".
std::string no_listener_words(const std::string& link) {
    if (!ethernet::describe(link).datagrams) return "; check the cable to the first slave";
    return ": no program listens there; emulate a line, as in: hal node ethercat FILE --link " +
           link;
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
    return "reports emergency " + hex(code, 4) + " (" + cia402::error_word(code) +
           "), error register " + hex(first >> 16 & 0xff, 2) + ", data" + data +
           "; see the manual of the device";
}

using bus::Effect;

/// The slave's name is at the beginning of its lines.
constexpr bus::EventRow<Event> event_rows[] = {
    {Event::link_lost, Effect::raises, "{port} has no link[{listener}]",
     "; no process data is exchanged"},
    {Event::link_restored, Effect::ends, "{port} has a link again"},
    {Event::no_slaves, Effect::raises, "no slave answers on {link}[; check {supply}]"},
    {Event::scanned, Effect::none, "found {slaves} on {link}"},
    {Event::too_many_slaves, Effect::none,
     "found {slaves} on {link}, more than the {second} this master has space for; add the others "
     "to the configuration"},
    {Event::slave_missing, Effect::raises,
     "{who} is not on the bus[; check its supply and cable, or {optional}]"},
    {Event::unknown_slave, Effect::raises,
     "{who} is not in the configuration[ (vendor {first8}, product {second8}); add {unknown}]"},
    {Event::unknown_gone, Effect::ends, "every slave on {link} is in the configuration"},
    {Event::wrong_vendor, Effect::raises, "{who} {identity}"},
    {Event::wrong_product, Effect::raises, "{who} {identity}"},
    {Event::wrong_revision, Effect::raises, "{who} {identity}"},
    {Event::wrong_serial, Effect::raises, "{who} {identity}"},
    {Event::duplicate_alias, Effect::raises,
     "{who} is not unique[: the slave at position {second} has the {alias} {first} too; neither is "
     "started: give each its own, power-cycle both and load the master again]",
     "; no slave with its number is started"},
    {Event::sii_failed, Effect::none, "{who} has an {eeprom}"},
    {Event::no_mailbox, Effect::none,
     "{who} has no mailbox, but the configuration writes {object} at start; delete its {writes}"},
    {Event::too_few_fmmus, Effect::none,
     "{who} has {first} FMMUs, its process data needs {second}; use fewer sync managers"},
    {Event::too_few_sync_managers, Effect::none,
     "{who} has {sync_managers}, the configuration needs {second}; correct {numbers}, which count "
     "from 0"},
    {Event::state_reached, Effect::none, ""},
    {Event::state_refused, Effect::none, "{who} rejects {state} with {al_status}{configured}"},
    {Event::state_timeout, Effect::none,
     "{who} did not reach {state} in time; it is in {other_state}: raise its time-out, or "
     "power-cycle it"},
    {Event::fell_back, Effect::raises, "{who} left its state[ and is in {state}, {al_status}]",
     " with AL status code {x}; its outputs are off"},
    {Event::startup_write_failed, Effect::none, "{who} {write}"},
    {Event::no_eoe, Effect::none,
     "{who} has no Ethernet over EtherCAT, but the configuration has `eoe`; delete that line"},
    {Event::eoe_failed, Effect::none,
     "{who} {eoe}; {power_cycle}write `eoe = yes` to leave them as they are"},
    {Event::mapping_failed, Effect::none, "{who} {mapping}"},
    {Event::mapping_differs, Effect::none,
     "{who} did not keep the PDO mapping: {object} is {second8} instead of {written}; this PDO is "
     "fixed: list its own entries"},
    {Event::too_many_entries, Effect::none,
     "{who} does not take {second} entries in PDO {first4}; spread them over several PDOs"},
    {Event::fixed_size, Effect::none,
     "{who} has no mailbox to change its PDO mapping: sync manager {sync_manager} has {bytes}, the "
     "configuration needs {needed}; list all of its own objects"},
    {Event::slave_lost, Effect::raises,
     "{who} does not answer[; check its supply and the cable to it]",
     "; its inputs keep their last values"},
    {Event::slave_returned, Effect::none, "{who} answers again"},
    {Event::slave_operational, Effect::ends, "{who} is operational after {second} ms"},
    {Event::wkc_incomplete, Effect::none,
     "domain '{domain}': working counter {counter} instead of {second}: {difference}"},
    {Event::wkc_complete, Effect::none,
     "domain '{domain}': every slave that is started exchanges process data"},
    {Event::reference_clock, Effect::none, "{who} has the reference clock{width}"},
    {Event::dc_unsupported, Effect::none,
     "{who} has no distributed clock, but the configuration has {dc}"},
    {Event::dc_timeout, Effect::none,
     "{who} deviates by {deviation} from the reference clock, more than the window of {window}; it "
     "is not started: check the cycle of the thread{sync_window}"},
    {Event::dc_tolerated, Effect::none,
     "{who} deviates by {deviation} from the reference clock, more than the window of {window}; it "
     "is started, because 10 us are tolerable: check the cycle of the thread{sync_window}"},
    {Event::dc_not_set, Effect::none,
     "{who} has a clock that could not be set within {first} ms: its receive times were not "
     "readable, or the ring is broken; it is not started: check its cables, or {no_dc}"},
    {Event::dc_lost, Effect::raises, "{who}[ {clock}]",
     " is out of step, its clock deviates by {us}{outputs_off}"},
    {Event::dc_far, Effect::raises, "{who}[ {clock}]",
     " is out of step, its clock deviates by more than 2.1 s{outputs_off}"},
    {Event::dc_recovered, Effect::ends,
     "{who} has a clock within the window again, after {second} ms"},
    {Event::dc_jumped, Effect::raises, "{who}[ {jump}]",
     " has the reference clock, which jumped by {us}; the clocks behind it are out of "
     "step{jumped_outputs}"},
    {Event::dc_jump_ended, Effect::ends,
     "the clocks behind {who} are within the window again, {second} ms after its clock jumped"},
    {Event::dc_synchronised, Effect::none,
     "all clocks are synchronised, largest deviation {deviation}"},
    {Event::ring_broken, Effect::none,
     "{break}: the ring is broken {there}; all slaves still exchange data, repair the cable"},
    {Event::ring_closed, Effect::none, "the ring is closed again"},
    {Event::topology_changed, Effect::none,
     "the number of slaves on {link} changed from {first} to {second}"},
    {Event::other_master, Effect::raises,
     "another EtherCAT master sends on {link}[ ({first} of its frames in a second): stop it, or "
     "give each master its own link]",
     "; the slaves obey both"},
    {Event::damaged_frames, Effect::none, "{who} received {frames} at {cable}"},
    {Event::emergency, Effect::none, "{who} {emergency}"},
    {Event::start_up_failed, Effect::raises,
     "{who} did not start[; it was in {state} and is started again in {second} s]",
     "; it is tried again"},
    {Event::slave_settled, Effect::none,
     "{who} is in {state}, the state of its configuration, after {second} ms"},
    {Event::data_stale, Effect::raises,
     "{who} is in OP, but its process data is not exchanged[: {staleness}]",
     "; its inputs keep their last values"},
    {Event::data_fresh, Effect::ends, "{who} exchanges process data again"},
};
static_assert(bus::in_order(event_rows));

/// What the values of a row are taken from.
struct Source {
    const EventRecord& what;
    const master::Setup& setup;
    const std::string& link;
    const std::string& backup;
    bool lcec;

    std::int64_t first() const { return what.first; }
    std::int64_t second() const { return what.second; }
    const master::Slave& slave() const {
        static const master::Slave unnamed;
        return what.slave < setup.slaves.size() ? setup.slaves[what.slave] : unnamed;
    }
    const std::string& port() const { return what.first == 0 ? link : backup; }
    /// Returns the text for the configuration that the user has.
    std::string by_format(const char* of_lcec, const char* own) const {
        return lcec ? of_lcec : own;
    }
};

std::string identity(const Source& s) {
    const auto of = [&](const char* what, const char* key, const char* attribute) {
        return identity_words(what, s.first(), s.second(), key, s.lcec ? attribute : nullptr);
    };
    switch (s.what.event) {
    case Event::wrong_vendor: return of("vendor", "vendor", "vid");
    case Event::wrong_product: return of("product code", "product", "pid");
    case Event::wrong_revision: return of("revision", "revision", nullptr);
    default: return of("serial number", "serial", nullptr);
    }
}

std::string unknown_slave(const Source& s) {
    const std::string position = std::to_string(s.what.slave - Events::of_position);
    if (!s.lcec) return "[slave " + position + " NAME], or write `other-slaves = accept` in [bus]";
    return "<slave idx=\"" + position + "\" type=\"generic\" vid=\"" + hex(s.first(), 8).substr(2) +
           "\" pid=\"" + hex(s.second(), 8).substr(2) + "\"/>";
}

std::string unreadable_eeprom(const Source& s) {
    const std::string status = hex(s.first(), 4);
    if ((s.first() & 0x1800) != 0 && s.second() == 7) {
        return "EEPROM with a wrong checksum (status " + status +
               "), so that its application does not run; write the contents anew with a tool of "
               "its maker, then power-cycle it";
    }
    return "unreadable EEPROM (status " + status + " at word " + hex(s.second(), 2) +
           "); power-cycle it";
}

std::string eoe_result(const Source& s) {
    if (s.first() == 0) return "does not answer its IP settings";
    return "rejects its IP settings with EoE result " + hex(s.first(), 4) + " (" +
           eoe::to_string(static_cast<eoe::Result>(s.first())) + ")";
}

std::string domain(const Source& s) {
    const auto number = static_cast<std::size_t>(s.first() >> 16);
    return number < s.setup.domains.size() ? s.setup.domains[number].name : std::to_string(number);
}

/// 092Ch has 31 bits for it; a larger deviation is shown as this one.
std::string deviation(std::int64_t ns) {
    constexpr std::int64_t largest_ns = 0x7fff'ffff;
    return ns < largest_ns ? microseconds(ns) : "more than 2.1 s";
}

std::string lost_clock(const Source& s) {
    const std::string distance =
        deviation(s.first()) + " from the reference clock, more than " + microseconds(s.second());
    if (s.setup.dc_loss == master::DcLoss::safeop) {
        return "has a clock that deviates by " + distance +
               "; it is taken to SAFE-OP until its clock is within the window again: check that "
               "the thread misses no cycles";
    }
    return "is operational, but its clock deviates by " + distance +
           "; check that the thread misses no cycles, and its manual for what it does without "
           "synchronisation. When all slaves behind the reference clock deviate alike, that clock "
           "has jumped. To set the clocks again: stop, then start";
}

std::string jumped_clock(const Source& s) {
    const std::string jump =
        "has the reference clock, which jumped by " + microseconds(std::abs(s.first())) +
        "; the clocks behind it deviate by more than " + microseconds(s.second()) + ": ";
    if (s.setup.dc_loss == master::DcLoss::safeop) {
        return jump +
               "their slaves are taken to SAFE-OP until they are within the window again; check "
               "its supply";
    }
    return jump +
           "check its supply, and the manuals of the slaves for what they do without "
           "synchronisation. To set the clocks again: stop, then start";
}

std::string staleness(const Source& s) {
    switch (static_cast<master::Staleness>(s.first())) {
    case master::Staleness::late:
        return std::string("the frames return later than ") +
               (s.setup.frame_timeout_ns != 0 ? "`frame-timeout`" : "the next cycle") +
               "; find what delays them, or allow more time with a longer cycle" +
               s.by_format("", " or `frame-timeout` in [bus]");
    case master::Staleness::counter:
        return "the working counter of its datagram is too small; it, or another slave of the same "
               "datagram, does not take part: power-cycle them";
    case master::Staleness::lost: break;
    }
    return "the frames with it do not return; check the cables and the network card";
}

struct Value {
    std::string_view name;
    std::string (*of)(const Source&);
};
constexpr Value values[] = {
    {"who", [](const Source& s) { return slave_words(s.what.slave, s.setup); }},
    {"link", [](const Source& s) { return s.link; }},
    {"port", [](const Source& s) { return s.port(); }},
    {"listener", [](const Source& s) { return no_listener_words(s.port()); }},
    {"supply",
     [](const Source& s) {
    return std::string(ethernet::describe(s.link).datagrams
                           ? "the address, and that a line of slaves is served there"
                           : "cable and supply of the first slave");
}},
    {"first", [](const Source& s) { return std::to_string(s.first()); }},
    {"second", [](const Source& s) { return std::to_string(s.second()); }},
    {"first4", [](const Source& s) { return hex(s.first(), 4); }},
    {"first8", [](const Source& s) { return hex(s.first(), 8); }},
    {"second8", [](const Source& s) { return hex(s.second(), 8); }},
    {"object", [](const Source& s) { return object_words(s.first()); }},
    {"written", [](const Source& s) { return hex(s.first() >> 24, 8); }},
    {"slaves", [](const Source& s) { return counted(s.first(), "slave"); }},
    {"sync_managers", [](const Source& s) { return counted(s.first(), "sync manager"); }},
    {"frames", [](const Source& s) { return counted(s.second(), "damaged frame"); }},
    {"bytes", [](const Source& s) { return counted(s.second(), "byte"); }},
    {"needed", [](const Source& s) { return std::to_string(s.first() & 0xffff); }},
    {"sync_manager", [](const Source& s) { return std::to_string(s.first() >> 16); }},
    {"state", [](const Source& s) { return state_words(s.first()); }},
    {"other_state", [](const Source& s) { return state_words(s.second()); }},
    {"al_status", [](const Source& s) { return al_words(s.second()); }},
    {"configured", [](const Source& s) { return configured_words(s.second(), s.slave()); }},
    {"deviation", [](const Source& s) { return deviation(s.first()); }},
    {"window", [](const Source& s) { return microseconds(s.second()); }},
    {"domain", domain},
    {"counter", [](const Source& s) { return std::to_string(s.first() & 0xffff); }},
    {"difference",
     [](const Source& s) {
    if ((s.first() & 0xffff) == 0) {
        return std::string("no slave takes part, or the frames are lost or late");
    }
    return std::string((s.first() & 0xffff) < s.second()
                           ? "some slaves do not exchange process data"
                           : "a slave answers that is not started yet");
}},
    {"staleness", staleness},
    {"width", [](const Source& s) { return std::string(s.first() != 0 ? "" : " (32 bits)"); }},
    {"alias",
     [](const Source& s) {
    return std::string(s.slave().identity.device_id ? "device ID" : "alias");
}},
    {"identity", identity},
    {"unknown", unknown_slave},
    {"eeprom", unreadable_eeprom},
    {"eoe", eoe_result},
    {"power_cycle",
     [](const Source& s) { return std::string(s.first() == 0 ? "power-cycle it, or " : ""); }},
    {"write", [](const Source& s) { return write_words(s.first(), s.second(), s.slave()); }},
    {"mapping",
     [](const Source& s) { return rejected_mapping_words(s.first(), s.second(), s.lcec); }},
    {"cable", [](const Source& s) { return cable_words(s.first(), s.setup, s.link); }},
    {"emergency", [](const Source& s) { return emergency_words(s.first(), s.second()); }},
    {"clock", lost_clock},
    {"jump", jumped_clock},
    {"jumped_outputs",
     [](const Source& s) {
    return std::string(s.setup.dc_loss == master::DcLoss::safeop
                           ? "; their outputs are off until they are in step again"
                           : "; to set them again: stop, then start");
}},
    {"break",
     [](const Source& s) {
    return s.what.slave == Events::bus
               ? s.link + " reaches no slave"
               : slave_words(s.what.slave, s.setup) + " is the last that the primary port reaches";
}},
    {"there",
     [](const Source& s) {
    return std::string(s.what.slave == Events::bus ? "there" : "behind it");
}},
    {"optional",
     [](const Source& s) {
    return s.by_format("delete its <slave>", "write `optional = yes` in its section");
}},
    {"writes",
     [](const Source& s) {
    return s.by_format("<sdoConfig>, <idnConfig> and <initCmds>", "`sdo` and `idn` lines");
}},
    {"numbers",
     [](const Source& s) {
    return s.by_format("idx of its <syncManager>",
                       "`outputs.sync-manager` or `inputs.sync-manager` in its section");
}},
    {"dc",
     [](const Source& s) { return s.by_format("<dcConf>; delete it", "`dc`; remove that line"); }},
    {"no_dc", [](const Source& s) { return s.by_format("delete its <dcConf>", "remove `dc`"); }},
    {"sync_window", [](const Source& s) { return s.by_format("", ", or raise `sync-window`"); }},
    {"outputs_off",
     [](const Source& s) {
    return std::string(s.setup.dc_loss == master::DcLoss::safeop
                           ? "; its outputs are off until it is in step again"
                           : "; to set its clock again: stop, then start");
}},
};

std::string value_of(std::string_view name, const Source& source) {
    const auto* const value = std::find_if(std::begin(values), std::end(values),
                                           [name](const Value& v) { return v.name == name; });
    return value == std::end(values) ? std::string(name) : value->of(source);
}

}  // namespace

MessageSubject subject(const EventRecord& what) {
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
    return link + " has no link" + no_listener_words(link);
}

std::string recorded_words(const std::string& link) {
    return link +
           " is a capture, whose slaves answer a master only; to see what is in it: hal ethercat "
           "dump FILE";
}

std::string unanswered_words(const std::string& file) {
    return file +
           " has no EtherCAT frame that returned from slaves; capture both directions at the "
           "interface of the master: tcpdump -i eth0 -w bus.pcap ether proto 0x88a4";
}

std::string slave_words(std::uint32_t slave, const master::Setup& setup) {
    if (slave >= Events::of_position && slave != Events::bus) {
        return "slave at position " + std::to_string(slave - Events::of_position);
    }
    if (slave >= setup.slaves.size()) return "slave " + std::to_string(slave);
    const master::Slave& s = setup.slaves[slave];
    std::string where = std::to_string(s.position);
    if (s.identity.device_id) {
        where = "id=" + std::to_string(*s.identity.device_id);
    } else if (s.identity.alias) {
        where = "alias=" + std::to_string(*s.identity.alias);
    }
    return "slave " + where + (s.name.empty() ? "" : " (" + s.name + ")");
}

std::string event_text(const EventRecord& what, const master::Setup& setup, const std::string& link,
                       const std::string& backup, Format format) {
    const Source source{what, setup, link, backup, format == Format::lcec};
    return bus::format(event_rows[static_cast<std::size_t>(what.event)].text, bus::Text::line,
                       [&](std::string_view name) { return value_of(name, source); });
}

bus::FaultTexts fault_texts(const master::Setup& setup, const std::string& link) {
    return {event_rows, setup.slaves.size(),
            [&](Event event, std::size_t slave, std::string_view name) -> std::string {
        const bool known = slave < setup.slaves.size();
        if (name == "who" && !known) return "a slave on " + link;
        if (name == "identity") return "is not the device of the configuration; it stays in INIT";
        const EventRecord what{event, known ? static_cast<std::uint32_t>(slave) : Events::bus};
        return value_of(name, {what, setup, link, link, false});
    }};
}

}  // namespace hal::ethercat::config
