// SPDX-License-Identifier: MIT
// The load arguments of the component tdma, and the schedule that they name.
#pragma once

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>

#include "bus/component/message_report.hpp"
#include "fieldbus/tdma/config/schedule.hpp"
#include "fieldbus/tdma/tunnel/tap.hpp"
#include "hal/component.hpp"
#include "hal/texts.hpp"

namespace hal::tdma {

struct StationArguments {
    explicit StationArguments(hal::Component& component) : c(component) {}

    hal::Component& c;
    hal::TextArgument link{c,
                           "link",
                           "",
                           "segment: eth:enp3s0, or sim:NAME/STATION in memory",
                           {.per_instance = true}};
    hal::TextArgument config_file{
        c, "config", "", "schedule file of the segment: RTnet's tdma.conf with extensions"};
    hal::TextArgument inline_schedule{c, "schedule", "",
                                      "the schedule as a text, with ; at the end of each line"};
    hal::TextArgument station{c,
                              "station",
                              "",
                              "block of this station: by name, ip or mac; auto, or an ip or mac "
                              "without config=: the master sends the block "
                              "(RTcfg)",
                              {.per_instance = true}};
    hal::TextArgument stage_2{
        c,
        "stage2",
        "",
        "with station=auto: where to write the file from the master (`stage2` in its schedule)",
        {.per_instance = true}};
    hal::TextArgument tunnel{c,
                             "tunnel",
                             "",
                             "network interface for ordinary packets in slot 1: hal0, or hal%d for "
                             "the first free number",
                             {.per_instance = true}};
    hal::TextArgument netmask{
        c, "netmask", "24",
        "netmask of the tunnel, 24 or 255.255.255.0; its address is the ip of the block"};

    // What load() reads.
    config::Schedule schedule;
    /// of this station; none: it gets its schedule by RTcfg
    std::optional<config::StationEntry> entry;
    StationSetup setup;
    std::optional<config::Ip> own_ip;  ///< of a station without a schedule
    std::optional<Address> own_mac;

    /// Reads and checks the schedule. Throws hal::ArgumentError or std::invalid_argument. [setup]
    void load() {
        const hal::Texts texts(c);
        std::string file = "schedule=";
        std::string text = inline_schedule.get();
        if (is_by_rtcfg()) {
            if (link.get().empty()) {
                throw std::invalid_argument("missing link=; write link=eth:enp3s0");
            }
            return check_tunnel();
        }
        if (!stage_2.get().empty()) {
            throw hal::ArgumentError(
                "stage2", "stage2= requires a schedule from the master; use station=auto");
        }
        if (config_file.get().empty() && text.empty()) {
            if (!texts.offered()) return;
            throw std::invalid_argument(
                "missing schedule: loadrt tdma link=eth:enp3s0 config=FILE.tdma station=NAME, or "
                "station=auto for a schedule from the "
                "master");
        }
        if (!config_file.get().empty() && !text.empty()) {
            throw hal::ArgumentError("config", "config= and schedule= are both given; remove one");
        }
        // in a netlist only: in a file it may be part of a comment
        std::replace(text.begin(), text.end(), ';', '\n');
        if (text.empty()) {
            file = texts.find(config_file.get());
            if (!config::read_from_disk(file, text)) {
                throw hal::ArgumentError("config", "config=" + config_file.get() +
                                                       ": cannot read '" + file + "': " + text);
            }
        }
        config::ReadResult reading = config::read(text);
        hal::bus::report(texts, reading.messages, file, text);
        schedule = std::move(reading.schedule);
        if (station.get().empty()) {
            throw std::invalid_argument("missing station=; stations in " + file + ": " +
                                        config::names(schedule));
        }
        const auto which = config::find(schedule, station.get());
        if (!which) {
            throw std::invalid_argument("unknown station '" + station.get() + "' in " + file +
                                        "; stations: " + config::names(schedule));
        }
        if (link.get().empty()) {
            throw std::invalid_argument("missing link=; write link=eth:enp3s0 or link=sim:NAME/" +
                                        station.get());
        }
        entry = schedule.stations[*which];
        setup = config::setup_of(schedule, *which);
        check_tunnel();
        check_tunnel_slot(file);
    }

    /// Returns true when the station gets its schedule by RTcfg; it is identified by its MAC
    /// address or by `station=10.0.0.3`.
    bool is_by_rtcfg() {
        const std::string& which = station.get();
        if (which != "auto") {
            if (!config_file.get().empty() || !inline_schedule.get().empty()) return false;
            own_ip = config::parse_ip(which);
            own_mac = ethernet::parse_address(which);
            if (!own_ip && !own_mac) return false;
        }
        setup.configured = false;
        setup.asks_master = true;
        setup.slot_capacity = max_slots;
        return true;
    }

    void check_tunnel() const {
        if (tunnel.get().empty()) return;
        if (auto problem = wrong_name(tunnel.get()); !problem.empty()) {
            throw hal::ArgumentError("tunnel", "tunnel=" + problem);
        }
        if (!parse_prefix(netmask.get())) {
            throw hal::ArgumentError(
                "netmask", "invalid netmask=" + netmask.get() + "; write 24 or 255.255.255.0");
        }
    }

    /// Checks that the schedule has a slot for the tunnel.
    void check_tunnel_slot(const std::string& file) const {
        if (tunnel.get().empty()) return;
        const auto is_tunnels = [](const SlotSetup& s) { return s.id == tunnel_slot; };
        if (std::none_of(setup.slots.begin(), setup.slots.end(), is_tunnels)) {
            throw hal::ArgumentError(
                "tunnel", "tunnel=" + tunnel.get() + ": ordinary packets use slot 1, and " +
                              entry->name + " has none; add slot 1 OFFSET to its block in " + file +
                              ": `hal tdma plan` shows the free time");
        }
    }
};

}  // namespace hal::tdma
