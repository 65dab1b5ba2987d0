// SPDX-License-Identifier: MIT
// Reads a `.ethercat` file: its sections, and which of them make up a slave.
#include <arpa/inet.h>

#include <algorithm>
#include <cstdio>
#include <set>

#include "ethercat/config/config_text.hpp"
#include "hal/read_file.hpp"

namespace hal::ethercat::config {

namespace {

class ConfigFile {
public:
    ConfigFile(std::string_view text, const std::string& path, const ReadFile& read)
        : sections_(split(text, report_)), descriptions_(read, path) {
        out_.buses.resize(1);
    }

    Reading read() {
        for (Section& s : sections_) {
            sort(s);
        }
        if (bus_ == nullptr) {
            report_.error(Topic::line, {1, 1, 0, 0}, "missing section [bus]",
                          "write [bus] and below it link = eth:enp3s0 and cycle = 1ms");
        } else {
            read_bus();
        }
        for (Section* s : domains_) {
            domain(*s);
        }
        for (Section* s : slaves_) {
            slave(*s);
        }
        if (reference_ != nullptr) {
            reference();
        }
        for (const auto& [name, s] : types_) {
            if (!used_types_.contains(name)) {
                report_.warning(
                    Topic::line, s->at, "unused type '" + name + "'",
                    "write type = " + name + " below a [slave …], or delete the section");
            }
        }
        if (slaves_.empty() && bus_ != nullptr) {
            report_.error(Topic::line, bus_->at, "the configuration has no slave",
                          "write [slave 0 NAME] and below it esi = FILE");
        }
        check_bus(out_.buses[0], report_);
        check_eoe(out_.buses[0], report_);
        out_.messages = std::move(report_.all);
        text::sort(out_.messages);  // a line of a type is read once for each slave of it
        return std::move(out_);
    }

private:
    void sort(Section& s) {
        const std::string kind = s.words.empty() ? "" : lower(s.words[0].text);
        const auto expect = [&](std::size_t words, const char* form) {
            if (s.words.size() == words) return true;
            report_.error(Topic::line, s.at, "invalid section name: expected " + std::string(form));
            return false;
        };
        const auto once = [&](Section*& to, const char* form) {
            if (!expect(1, form)) return;
            if (to != nullptr) {
                report_.error(Topic::line, s.at, "duplicate section " + std::string(form),
                              "first in line " + std::to_string(to->at.line), "duplicate");
            } else {
                to = &s;
            }
        };
        if (kind == "bus") {
            once(bus_, "[bus]");
        } else if (kind == "defaults") {
            once(defaults_, "[defaults]");
        } else if (kind == "type") {
            if (expect(2, "[type NAME]") && !types_.emplace(s.words[1].text, &s).second) {
                report_.error(Topic::line, s.words[1].at,
                              "duplicate type '" + s.words[1].text + "'",
                              "rename or delete one of them", "duplicate");
            }
        } else if (kind == "domain") {
            if (expect(2, "[domain NAME]")) {
                domains_.push_back(&s);
            }
        } else if (kind == "slave") {
            slaves_.push_back(&s);
        } else {
            const std::string near =
                did_you_mean(kind, {"bus", "defaults", "type", "domain", "slave"});
            report_.error(Topic::line, s.at,
                          "unknown section '" + (s.words.empty() ? "" : s.words[0].text) + "'",
                          near.empty() ? "the sections are [bus], [defaults], [type NAME], [domain "
                                         "NAME], [slave POSITION NAME]"
                                       : near);
        }
    }

    void unknown_keys(const Keys& keys, const char* where, const std::vector<std::string>& all) {
        for (const Line* line : keys.all()) {
            if (!line->used) {
                report_.error(Topic::line, line->key.at,
                              "unknown key '" + line->key.text + "' in " + where,
                              suggestion(line->key.text, all, "the keys are"));
            }
        }
    }

    void read_bus() {
        Bus& bus = out_.buses[0];
        bus.at = bus_->at;
        Keys keys(report_);
        keys.take(*bus_);
        keys.take_text("link", bus.link);
        keys.take_text("backup", bus.backup);
        bus.cycle_given = keys.take_time("cycle", bus.setup.cycle_ns, 10'000, 1'000'000'000);
        if (Line* line = keys.find("clock")) {
            if (same_word(line->value.text, "reference")) {
                bus.setup.lead = master::ClockLead::reference;
            } else if (same_word(line->value.text, "thread")) {
                bus.setup.lead = master::ClockLead::thread;
            } else if (same_word(line->value.text, "none")) {
                bus.setup.lead = master::ClockLead::none;
            } else {
                keys.reject(*line, "reference, thread or none");
            }
        }
        reference_ = keys.find("reference");
        keys.take_time("frame-timeout", bus.setup.frame_timeout_ns, 10'000, 1'000'000'000);
        keys.take_time("sync-window", bus.setup.sync_window_ns, 10, 1'000'000'000);
        if (Line* line = keys.find("gateway")) {
            if (!read_gateway(line->value.text, bus)) {
                keys.reject(*line, "none, or an IPv4 address and perhaps a port: 127.0.0.1:34980");
            } else if (!bus.gateway.empty() && !bus.gateway.starts_with("127.")) {
                report_.warning(Topic::value, line->value.at,
                                "programs on other computers can read and write the objects of the "
                                "slaves through the gateway",
                                "its protocol has no password; write 127.0.0.1 to allow only "
                                "programs on this computer");
            }
        }
        if (Line* line = keys.find("dc-loss")) {
            if (same_word(line->value.text, "safeop")) {
                bus.setup.dc_loss = master::DcLoss::safeop;
            } else if (!same_word(line->value.text, "report")) {
                keys.reject(*line, "report or safeop");
            }
        }
        keys.take_time("dc-loss-time", bus.setup.dc_loss_ns, 1'000'000, 60'000'000'000);
        read_eoe_switch(keys, bus);
        if (Line* line = keys.find("other-slaves")) {
            if (same_word(line->value.text, "accept")) {
                bus.setup.accept_other_slaves = true;
            } else if (!same_word(line->value.text, "fault")) {
                keys.reject(*line, "fault or accept");
            }
        }
        if (!bus.backup.empty() && bus.backup == bus.link) {
            report_.error(Topic::value, keys.find("backup")->value.at,
                          "the backup is the link itself: '" + bus.link + "'",
                          "write the address of the second port, which closes the ring");
        }
        unknown_keys(
            keys, "[bus]",
            {"link", "backup", "cycle", "clock", "reference", "frame-timeout", "sync-window",
             "dc-loss", "dc-loss-time", "other-slaves", "gateway", "eoe-switch"});
    }

    void domain(Section& s) {
        auto& domains = out_.buses[0].setup.domains;
        master::Domain d;
        d.name = s.words[1].text;
        Keys keys(report_);
        keys.take(s);
        std::uint64_t every = 1;
        keys.take_number("every", every, 1, 1000);
        d.every = static_cast<unsigned>(every);
        unknown_keys(keys, "[domain]", {"every"});
        for (std::size_t i = 0; i < domains.size(); ++i) {
            if (domains[i].name != d.name) continue;
            if (i != 0 || default_given_) {
                return report_.error(Topic::line, s.words[1].at,
                                     "duplicate domain '" + d.name + "'",
                                     "rename or delete one of them", "duplicate");
            }
            default_given_ = true;
            domains[0] = d;
            return;
        }
        domains.push_back(std::move(d));
    }

    void slave(Section& s) {
        Bus& bus = out_.buses[0];
        master::Slave slave;
        SlaveInfo info;
        info.at = s.at;
        slave.line = s.at.line;
        const Word where = s.words.size() >= 2 ? s.words[1] : Word{"", s.at};
        const std::size_t equals = where.text.find('=');
        const std::string by = equals == std::string::npos
                                   ? ""
                                   : lower(std::string_view(where.text).substr(0, equals));
        const auto number = parse_natural(equals == std::string::npos
                                              ? std::string_view(where.text)
                                              : std::string_view(where.text).substr(equals + 1));
        if (!number || *number > 65535 || s.words.size() > 3 ||
            (!by.empty() && by != "alias" && by != "id")) {
            return report_.error(
                Topic::line, where.at,
                "invalid slave section: expected a position of 0..65535 and a name",
                "write [slave 0 NAME], [slave alias=5 NAME] or [slave id=5 NAME]");
        }
        const auto value = static_cast<std::uint16_t>(*number);
        if (by == "alias" && value == 0) {
            return report_.error(Topic::line, where.at, "alias 0 means that a slave has none",
                                 "write its position, as in [slave 0 NAME]");
        }
        if (by == "alias") {
            slave.identity.alias = value;
        } else if (by == "id") {
            slave.identity.device_id = value;
        } else {
            slave.position = value;
        }
        slave.name = s.words.size() == 3
                         ? dashed(s.words[2].text)
                         : (by.empty() ? "slave" : by) + "-" + std::to_string(*number);
        Keys keys(report_);
        if (defaults_ != nullptr) {
            keys.take(*defaults_);
        }
        std::string type;
        for (Line& line : s.lines) {
            if (line.key.text == "type") {
                type = line.value.text;
                const auto at = types_.find(type);
                if (at != types_.end()) {
                    used_types_.insert(type);
                    keys.take(*at->second);
                    continue;
                }
                std::vector<std::string> names;
                for (const auto& t : types_) {
                    names.push_back(t.first);
                }
                const std::string near = did_you_mean(type, names);
                report_.error(Topic::line, line.value.at, "unknown type '" + type + "'",
                              !near.empty()   ? near
                              : names.empty() ? "write [type " + type + "]"
                                              : "the types are: " + listed(names));
                return;
            }
        }
        keys.take(s);
        read_slave({keys, descriptions_, bus, slave, info});
        bus.setup.slaves.push_back(std::move(slave));
        bus.slaves.push_back(std::move(info));
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
    std::vector<Section> sections_;
    Descriptions descriptions_;
    Section *bus_ = nullptr, *defaults_ = nullptr;
    std::map<std::string, Section*> types_;
    std::set<std::string> used_types_;
    std::vector<Section*> slaves_, domains_;
    const Line* reference_ = nullptr;
    bool default_given_ = false;
    Reading out_;
};

}  // namespace

const PinInfo* SlaveInfo::find(std::string_view pin) const {
    for (const auto& [name, about] : pins) {
        if (name == pin) return &about;
    }
    return nullptr;
}

const esi::File* Descriptions::get(const Word& file, Report& report) {
    auto [at, fresh] = known_.try_emplace(file.text);
    if (fresh) {
        std::string bytes;
        const std::string path = file.text.starts_with('/') ? file.text : folder_ + file.text;
        if (!read_(path, bytes)) {
            report.error(Topic::value, file.at, "cannot read '" + path + "': " + bytes,
                         "write the path of an ESI file, relative to this file");
        } else {
            esi::File read = esi::read(bytes);
            for (const esi::Message& m : read.messages) {
                if (m.severity == Severity::error) {
                    report.error(
                        Topic::value, file.at,
                        "'" + path + "', line " + std::to_string(m.at.line) + ": " + m.sentence,
                        m.help);
                }
            }
            const auto warnings = std::count_if(
                read.messages.begin(), read.messages.end(),
                [](const esi::Message& m) { return m.severity == Severity::warning; });
            if (read.good() && warnings != 0) {
                const esi::Message& first = read.messages.front();
                std::string sentence =
                    "'" + path + "', line " + std::to_string(first.at.line) + ": " + first.sentence;
                if (warnings > 1) {
                    sentence += ", and " + std::to_string(warnings - 1) + " more";
                }
                report.warning(Topic::value, file.at, std::move(sentence),
                               "correct the description where the master uses it");
            }
            if (read.good()) {
                at->second = std::move(read);
            }
        }
    }
    return at->second ? &*at->second : nullptr;
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

}  // namespace

void check_bus(const Bus& bus, Report& report) {
    const auto& slaves = bus.setup.slaves;
    for (std::size_t i = 0; i < slaves.size(); ++i) {
        check_watchdog(bus, i, report);
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

Reading read(std::string_view text, const std::string& path, const ReadFile& read_file) {
    return trimmed(text).starts_with('<') || trimmed(text).starts_with("\xef\xbb\xbf<")
               ? read_lcec(text, path, read_file)
               : ConfigFile(text, path, read_file).read();
}

std::string to_string(const Reading& reading, const std::string& path) {
    return text::errors_text(reading.messages, path);
}

}  // namespace hal::ethercat::config
