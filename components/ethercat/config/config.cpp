// SPDX-License-Identifier: MIT
// Reads a `.ethercat` file: its sections, and which of them make up a slave.
#include <arpa/inet.h>

#include <algorithm>
#include <cstdio>

#include "ethercat/config/config_text.hpp"
#include "ethercat/config/data_copies.hpp"
#include "hal/read_file.hpp"

namespace hal::ethercat::config {

namespace {

constexpr bus::SectionKind kinds[] = {
    {"bus", "[bus]", bus::SectionUse::once},
    {"domain", "[domain NAME]", bus::SectionUse::named},
    {"slave", "[slave POSITION NAME]", bus::SectionUse::any},
    {"copy", "[copy]", bus::SectionUse::once},
};

constexpr std::int64_t us = 1'000;
constexpr std::int64_t second = 1'000'000'000;

/// What the keys of [bus] are read into.
struct BusTarget {
    Bus& bus;
    Report& report;
};

constexpr bus::Choice<master::ClockLead> clocks[] = {{"reference", master::ClockLead::reference},
                                                     {"thread", master::ClockLead::thread},
                                                     {"none", master::ClockLead::none}};
constexpr bus::Choice<master::DcLoss> losses[] = {{"report", master::DcLoss::report},
                                                  {"safeop", master::DcLoss::safeop}};
constexpr bus::Choice<bool> others[] = {{"fault", false}, {"accept", true}};

template <class T>
auto of_bus(T Bus::* member) {
    return [member](BusTarget& to) -> T& { return to.bus.*member; };
}
template <class T>
auto of_setup(T master::Setup::* member) {
    return [member](BusTarget& to) -> T& { return to.bus.setup.*member; };
}

bool read_gateway_key(BusTarget& to, const Line& line) {
    if (!read_gateway(line.value.text, to.bus)) return false;
    if (!to.bus.gateway.empty() && !to.bus.gateway.starts_with("127.")) {
        to.report.warning(Topic::value, line.value.at,
                          "programs on other computers can read and write the objects of the "
                          "slaves through the gateway",
                          "its protocol has no password; write 127.0.0.1 to allow only programs on "
                          "this computer");
    }
    return true;
}

bool read_switch_key(BusTarget& to, const Line& line) { return read_eoe_switch(to.bus, line); }

const bus::KeyTable<BusTarget>& bus_keys() {
    using S = master::Setup;
    static const bus::KeyTable<BusTarget> table{{
        {"link", bus::text_value(of_bus(&Bus::link), "ADDRESS"), "`sim:ethercat`",
         "address of the link: `eth:enp3s0`, `sim:NAME` or `udp:HOST`; see [the "
         "addresses](ethernet.md#raw-ethernet)"},
        {"backup", bus::text_value(of_bus(&Bus::backup), "ADDRESS"), "none",
         "address of a second link, which closes a ring; a broken cable then costs no cycle"},
        {"cycle", bus::time(of_setup(&S::cycle_ns), 10 * us, second), "`1ms`",
         "cycle time, which is the period of the thread that runs the functions of the master. "
         "`loadrt ethercat cycle=250000` (in ns) overrides it"},
        {"clock", bus::choice(of_setup(&S::lead), clocks), "`reference`",
         "`reference`: the threads follow the reference clock. `thread`: the reference clock "
         "follows the thread. `none`: neither follows the other; only the clocks of the slaves "
         "agree with each other"},
        {"reference", "the name of a slave", "first slave with a 64-bit clock",
         "name of the slave with the reference clock"},
        {"frame-timeout", bus::time(of_setup(&S::frame_timeout_ns), 10 * us, second), "next cycle",
         "time after which a frame counts as lost. A frame that returns earlier is an answer, in a "
         "later cycle too, but not on a ring. Requests to slaves wait for 2 ms, for two cycles "
         "or for this time, whichever is longest"},
        {"sync-window", bus::time(of_setup(&S::sync_window_ns), 10, second), "`1us`",
         "clock deviation below which a slave counts as synchronised"},
        {"dc-loss", bus::choice(of_setup(&S::dc_loss), losses), "`report`",
         "reaction to a slave in OP whose clock deviates by more than `sync-window`, or by more "
         "than "
         "10 us if `sync-window` is smaller, for longer than `dc-loss-time`; see [Distributed "
         "clocks](#distributed-clocks)"},
        {"dc-loss-time", bus::time(of_setup(&S::dc_loss_ns), 1'000 * us, 60 * second), "`500ms`",
         "duration for which a clock may deviate. The deviation is checked every 100 ms"},
        {"eoe-switch", bus::own(expected_eoe_switch, "an interface, an address", &read_switch_key),
         "none",
         "network interface of this computer that is shared by all slaves with `eoe`, as by a "
         "switch. An address may follow the name: `eoe0 192.168.2.1/24`. Without this key, each of "
         "these slaves has an interface of its own"},
        {"gateway",
         bus::own("none, or an IPv4 address and perhaps a port: 127.0.0.1:34980",
                  "none, an address", &read_gateway_key),
         "`none`",
         "address of the mailbox gateway (ETG.8200), `127.0.0.1` or `127.0.0.1:34980`. While the "
         "machine runs, other programs reach the mailboxes of the slaves at this address by UDP "
         "and "
         "TCP. The protocol has no password: with any other address, everyone in that network can "
         "write the objects of the drives. `loadrt ethercat gateway=127.0.0.1` overrides this key"},
        {"other-slaves", bus::choice(of_setup(&S::accept_other_slaves), others), "`fault`",
         "reaction to slaves that the file does not name: `fault` reports a fault, `accept` does "
         "not"},
    }};
    return table;
}

const bus::KeyTable<master::Domain>& domain_keys() {
    static const bus::KeyTable<master::Domain> table{{
        {"every", bus::number(&master::Domain::every, 1, 1000), "`1`",
         "the process data is exchanged in every so many cycles"},
    }};
    return table;
}

class ConfigFile {
public:
    ConfigFile(std::string_view text, const std::string& path, const ReadFile& read)
        : sections_(text, kinds, "[slave 0 NAME]", key_report_), descriptions_(read, path) {
        out_.buses.resize(1);
    }

    ReadResult read() {
        Section* const bus = sections_.one("bus");
        if (bus == nullptr) {
            report_.error(Topic::line, {1, 1, 0, 0}, "missing section [bus]",
                          "write [bus] and below it link = eth:enp3s0 and cycle = 1ms");
        } else {
            read_bus(*bus);
        }
        for (Section* s : sections_.all("domain")) {
            domain(*s);
        }
        for (Section* s : sections_.all("slave")) {
            slave(*s);
        }
        if (reference_ != nullptr) {
            reference();
        }
        if (Section* const copies = sections_.one("copy")) {
            DataCopyReader(out_.buses[0], report_).read(*copies);
        }
        sections_.warn_unused_types("[slave …]");
        if (sections_.all("slave").empty() && bus != nullptr) {
            report_.error(Topic::line, bus->at, "the configuration has no slave",
                          "write [slave 0 NAME] and below it esi = FILE");
        }
        check_bus(out_.buses[0], report_);
        check_eoe(out_.buses[0], report_);
        out_.messages = std::move(report_.all);
        text::sort(out_.messages);  // a line of a type is read once for each slave of it
        return std::move(out_);
    }

private:
    void read_bus(Section& section) {
        Bus& bus = out_.buses[0];
        bus.at = section.at;
        Keys keys(key_report_);
        keys.add(section);
        BusTarget target{bus, report_};
        bus_keys().apply(keys, target, key_report_);
        bus.cycle_given = keys.find("cycle") != nullptr;
        reference_ = keys.find("reference");
        if (!bus.backup.empty() && bus.backup == bus.link) {
            report_.error(Topic::value, keys.find("backup")->value.at,
                          "the backup is the link itself: '" + bus.link + "'",
                          "write the address of the second port, which closes the ring");
        }
        keys.report_rest("in [bus]", bus_keys().names());
    }

    void domain(Section& s) {
        auto& domains = out_.buses[0].setup.domains;
        master::Domain d;
        d.name = s.words[1].text;
        Keys keys(key_report_);
        keys.add(s);
        domain_keys().apply(keys, d, key_report_);
        keys.report_rest("in [domain]", domain_keys().names());
        const auto other =
            std::find_if(domains.begin(), domains.end(),
                         [&](const master::Domain& one) { return one.name == d.name; });
        if (other == domains.end()) {
            domains.push_back(std::move(d));
        } else if (other != domains.begin() || default_given_) {
            report_.error(Topic::line, s.words[1].at, "duplicate domain '" + d.name + "'",
                          "rename or delete one of them", "duplicate");
        } else {
            default_given_ = true;
            domains[0] = d;
        }
    }

    void slave(Section& s) {
        Bus& bus = out_.buses[0];
        master::Slave slave;
        SlaveInfo info;
        info.at = s.at;
        slave.line = s.at.line;
        if (!read_header(s, slave)) return;
        Keys keys(key_report_);
        if (!sections_.add_keys(s, keys)) return;
        read_slave({keys, report_, descriptions_, bus, slave, info});
        bus.setup.slaves.push_back(std::move(slave));
        bus.slaves.push_back(std::move(info));
    }

    /// Reads [slave 0 NAME], [slave alias=5 NAME] or [slave id=5 NAME].
    bool read_header(const Section& s, master::Slave& slave) {
        const Word where = s.words.size() >= 2 ? s.words[1] : Word{"", s.at};
        const std::size_t equals = where.text.find('=');
        const bool has_kind = equals != std::string::npos;
        const std::string kind = has_kind ? lower(where.text.substr(0, equals)) : "";
        const auto number = parse_natural(has_kind ? where.text.substr(equals + 1) : where.text);
        const bool is_known = !has_kind || kind == "alias" || kind == "id";
        if (!number || *number > 65535 || s.words.size() > 3 || !is_known) {
            report_.error(Topic::line, where.at,
                          "invalid slave section: expected a position of 0..65535 and a name",
                          "write [slave 0 NAME], [slave alias=5 NAME] or [slave id=5 NAME]");
            return false;
        }
        const auto value = static_cast<std::uint16_t>(*number);
        if (kind == "alias" && value == 0) {
            report_.error(Topic::line, where.at, "alias 0 means that a slave has none",
                          "write its position, as in [slave 0 NAME]");
            return false;
        }
        if (kind == "alias") {
            slave.identity.alias = value;
        } else if (kind == "id") {
            slave.identity.device_id = value;
        } else {
            slave.position = value;
        }
        slave.name = (has_kind ? kind : "slave") + "-" + std::to_string(*number);
        if (s.words.size() == 3) {
            slave.name = dashed(s.words[2].text);
        }
        return true;
    }

    void reference() {
        auto& setup = out_.buses[0].setup;
        std::vector<std::string> names;
        for (std::size_t i = 0; i < setup.slaves.size(); ++i) {
            names.push_back(setup.slaves[i].name);
            if (setup.slaves[i].name == reference_->value.text) {
                setup.reference_slave = static_cast<std::uint16_t>(i);
            }
        }
        if (!setup.reference_slave) {
            report_.error(Topic::slave, reference_->value.at,
                          "unknown slave '" + reference_->value.text + "'",
                          suggestion(reference_->value.text, names, "the slaves are"));
        }
    }

    Report report_;
    bus::TopicReport<Topic> key_report_{report_};
    bus::SectionFile sections_;
    Descriptions descriptions_;
    const Line* reference_ = nullptr;
    bool default_given_ = false;
    ReadResult out_;
};

}  // namespace

std::string bus_reference() { return bus_keys().reference(); }

const PinInfo* SlaveInfo::find(std::string_view pin) const {
    for (const auto& [name, about] : pins) {
        if (name == pin) return &about;
    }
    return nullptr;
}

const esi::File* Descriptions::get(const Word& file, Report& report) {
    auto [at, fresh] = known_.try_emplace(file.text);
    if (fresh) {
        at->second = read(file, report);
    }
    return at->second ? &*at->second : nullptr;
}

std::optional<esi::File> Descriptions::read(const Word& file, Report& report) {
    std::string bytes;
    const std::string path = file.text.starts_with('/') ? file.text : folder_ + file.text;
    if (!read_(path, bytes)) {
        report.error(Topic::value, file.at, "cannot read '" + path + "': " + bytes,
                     "write the path of an ESI file, relative to this file");
        return std::nullopt;
    }
    esi::File description = esi::read(bytes);
    const auto sentence_of = [&](const esi::Message& m) {
        return "'" + path + "', line " + std::to_string(m.at.line) + ": " + m.sentence;
    };
    std::size_t warnings = 0;
    for (const esi::Message& m : description.messages) {
        if (m.severity == Severity::error) {
            report.error(Topic::value, file.at, sentence_of(m), m.help);
        }
        warnings += m.severity == Severity::warning;
    }
    if (!description.good()) return std::nullopt;
    if (warnings != 0) {
        std::string sentence = sentence_of(description.messages.front());
        if (warnings > 1) {
            sentence += ", and " + std::to_string(warnings - 1) + " more";
        }
        report.warning(Topic::value, file.at, std::move(sentence),
                       "correct the description where the master uses it");
    }
    return description;
}

namespace {

/// The outputs of a slave must arrive before its watchdog ends: 100 ms, unless it is set.
void check_watchdog(const Bus& bus, std::size_t n, Report& report) {
    const master::Slave& s = bus.setup.slaves[n];
    constexpr std::int64_t unit_ns = 40;  // of the divider, which counts from 2
    constexpr std::uint16_t usual_divider = 2498;
    constexpr std::uint16_t usual_intervals = 1000;
    const std::int64_t watchdog_ns = unit_ns * (s.watchdog.divider.value_or(usual_divider) + 2) *
                                     s.watchdog.intervals.value_or(usual_intervals);
    const bool watched = std::any_of(s.sync_managers.begin(), s.sync_managers.end(),
                                     [](const master::SyncManager& sm) {
        return sm.output && sm.watchdog && (sm.control == 0 || (sm.control & 0x40) != 0) &&
               !sm.pdos.empty();
    });
    if (!watched || watchdog_ns == 0 || s.target != State::op ||
        s.domain >= bus.setup.domains.size()) {
        return;
    }
    const std::int64_t every_ns = bus.setup.cycle_ns * bus.setup.domains[s.domain].every;
    if (every_ns < watchdog_ns) return;
    const auto milliseconds = [](std::int64_t ns) {
        char text[32];
        std::snprintf(text, sizeof text, "%.6gms", static_cast<double>(ns) * 1e-6);
        return std::string(text);
    };
    report.error(
        Topic::slave, bus.slaves[n].at,
        "the outputs of '" + s.name + "' are sent every " + milliseconds(every_ns) +
            ", but its watchdog ends after " + milliseconds(watchdog_ns),
        "write watchdog = " + milliseconds(std::min<std::int64_t>(5 * every_ns, 6553'000'000)) +
            " in its section, watchdog = none, or a shorter cycle");
}

/// The samples of a cycle are lost if the process data are not exchanged in each cycle.
void check_samples(const Bus& bus, std::size_t n, Report& report) {
    const master::Slave& s = bus.setup.slaves[n];
    if (s.oversampling < 2 || s.domain >= bus.setup.domains.size()) return;
    const master::Domain& domain = bus.setup.domains[s.domain];
    if (domain.every == 1) return;
    report.error(Topic::slave, bus.slaves[n].at,
                 "'" + s.name + "' has " + std::to_string(s.oversampling) +
                     " samples in each cycle, but domain '" + domain.name +
                     "' is exchanged in every " + std::to_string(domain.every) +
                     " cycles: the samples between are lost",
                 "write a domain with every = 1, or delete oversampling in its section");
}

}  // namespace

void check_bus(const Bus& bus, Report& report) {
    const auto& slaves = bus.setup.slaves;
    for (std::size_t i = 0; i < slaves.size(); ++i) {
        check_watchdog(bus, i, report);
        check_samples(bus, i, report);
    }
    for (std::size_t i = 0; i < slaves.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) {
            const std::string first = "first in line " + std::to_string(bus.slaves[j].at.line);
            const auto &a = slaves[i], &b = slaves[j];
            const auto by_position = [](const master::Slave& s) {
                return !s.identity.alias && !s.identity.device_id;
            };
            if (a.name == b.name) {
                report.error(Topic::slave, bus.slaves[i].at,
                             "duplicate slave name '" + a.name + "'", first, "duplicate");
            }
            if (by_position(a) && by_position(b) && a.position == b.position) {
                report.error(Topic::slave, bus.slaves[i].at,
                             "duplicate position " + std::to_string(a.position), first,
                             "duplicate");
            }
            if (a.identity.alias && a.identity.alias == b.identity.alias) {
                report.error(Topic::slave, bus.slaves[i].at,
                             "duplicate alias " + std::to_string(*a.identity.alias), first,
                             "duplicate");
            }
            if (a.identity.device_id && a.identity.device_id == b.identity.device_id) {
                report.error(Topic::slave, bus.slaves[i].at,
                             "duplicate device ID " + std::to_string(*a.identity.device_id), first,
                             "duplicate");
            }
        }
    }
}

bool read_gateway(std::string_view text, Bus& bus) {
    bus.gateway.clear();
    if (same_word(text, "none")) return true;
    const std::size_t colon = text.find(':');
    const std::string address(text.substr(0, colon));
    in_addr parsed{};
    if (inet_pton(AF_INET, address.c_str(), &parsed) != 1) return false;
    if (colon != std::string_view::npos) {
        const auto port = parse_natural(text.substr(colon + 1));
        if (!port || *port == 0 || *port > 65535) return false;
        bus.gateway_port = static_cast<std::uint16_t>(*port);
    }
    bus.gateway = address;
    return true;
}

bool read_from_disk(const std::string& path, std::string& bytes) {
    return read_regular_file(path, 64'000'000, bytes);
}

ReadResult read(std::string_view text, const std::string& path, const ReadFile& read_file,
                const IsAssumed& is_assumed) {
    return trimmed(text).starts_with('<') || trimmed(text).starts_with("\xef\xbb\xbf<")
               ? read_lcec(text, path, read_file, is_assumed)
               : ConfigFile(text, path, read_file).read();
}

std::string to_string(const ReadResult& reading, const std::string& path) {
    return text::errors_text(reading.messages, path);
}

}  // namespace hal::ethercat::config
