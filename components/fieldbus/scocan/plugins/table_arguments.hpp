// SPDX-License-Identifier: MIT
// The load arguments of all SCoCAN components, and the table that they name.
#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>
#include <vector>

#include "bus/component/message_report.hpp"
#include "fieldbus/scocan/station/station_events.hpp"
#include "hal/component.hpp"
#include "hal/texts.hpp"
#include "text/suggest.hpp"

namespace hal::scocan {

struct TableArguments {
    explicit TableArguments(hal::Component& component) : c(component) {}

    hal::Component& c;
    hal::TextArgument link{
        c, "link", "", "bus: sim:NAME, can:can0 or udp:GROUP:PORT", {.per_instance = true}};
    hal::TextArgument config{c, "config", "",
                             "table of the bus, NAME.scocan; the same file for all nodes"};
    hal::TextArgument inline_table{c, "table", "",
                                   "the table as a text, with ; at the end of each line"};
    hal::TextArgument node{c, "node", "", "name of this node in the table", {.per_instance = true}};
    hal::TextArgument receives{c, "receive", "all",
                               "messages of other nodes that get pins: all, none, or NAME,NAME"};
    hal::Argument follow{c,
                         "follow",
                         0,
                         "1: the threads of this process are synchronised to the SYNC",
                         {.min = 0, .max = 1}};
    hal::Argument windows{
        c,
        "windows",
        1,
        "0: transmit windows of the controller are not used; the thread sends when a slot has come",
        {.min = 0, .max = 1}};
    hal::Argument single_shot{c,
                              "single_shot",
                              1,
                              "0: the controller repeats disturbed frames in private slots",
                              {.min = 0, .max = 1}};
    hal::RealArgument ppm{c, "ppm", 0, "rate error of the clock of a simulated node, ppm"};
    hal::Argument tick_ns{c,
                          "tick_ns",
                          0,
                          "resolution of the time stamps of a simulated node, ns",
                          {.min = 0, .max = 1'000'000}};

    // What load() reads.
    Table table;
    std::size_t own = 0;
    bool loaded = false;

    /// Reads the table and finds the node, which must have one of these roles. `component` is what
    /// to load for the others. [setup]
    void load(std::initializer_list<Role> roles) {
        const hal::Texts texts(c);
        std::string file = "table=";
        std::string text = inline_table.get();
        if (config.get().empty() && text.empty()) {
            if (!texts.offered()) return;
            throw std::invalid_argument(
                "missing table: write link=sim:NAME config=FILE.scocan node=NAME");
        }
        if (!config.get().empty() && !text.empty()) {
            throw hal::ArgumentError("config", "config= and table= are both given; remove one");
        }
        std::replace(text.begin(), text.end(), ';', '\n');
        if (text.empty()) {
            file = texts.find(config.get());
            text = texts.read("config", config.get());
        }
        ReadResult reading = read(text);
        hal::bus::report(texts, reading.messages, file, text);
        table = std::move(reading.table);
        if (node.get().empty()) {
            throw std::invalid_argument("missing node=; nodes in " + file + ": " + names(table));
        }
        const auto found = table.find(node.get());
        if (!found) {
            throw std::invalid_argument("unknown node '" + node.get() + "' in " + file +
                                        "; nodes: " + names(table));
        }
        own = *found;
        const Role role = table.nodes[own].role;
        if (std::find(roles.begin(), roles.end(), role) == roles.end()) {
            constexpr const char* components[] = {"scocan", "scocan_sync", "scocan_sync",
                                                  "scocan_monitor", "scocan_bridge"};
            throw hal::ArgumentError("node", "node=" + node.get() + " has the role " +
                                                 to_string(role) + "; load it by: loadrt " +
                                                 components[static_cast<std::size_t>(role)] +
                                                 " node=" + node.get());
        }
        check_receives(file);
        if (link.get().empty()) {
            throw std::invalid_argument("missing link=; write link=sim:NAME or link=can:can0");
        }
        loaded = true;
    }

    /// Rejects a name in receive= that is not that of a message. [setup]
    void check_receives(const std::string& file) const {
        const std::string& list = receives.get();
        if (list == "all" || list == "none") return;
        std::vector<std::string> all;
        for (const Message& m : table.messages) {
            all.push_back(m.name);
        }
        for (std::size_t at = 0; at <= list.size();) {
            const std::size_t end = std::min(list.find(',', at), list.size());
            const std::string one = list.substr(at, end - at);
            if (std::find(all.begin(), all.end(), one) == all.end()) {
                throw hal::ArgumentError(
                    "receive", "receive: unknown message '" + one + "' in " + file + "; " +
                                   suggestion(one, all, "write all, none, or names of messages"));
            }
            at = end + 1;
        }
    }

    StationOptions options() const {
        return {.single_shot = single_shot != 0,
                .windows = windows != 0,
                .crystal = {.ppm = ppm, .tick = tick_ns, .epoch = 0}};
    }

    /// Returns whether a message of another node gets pins. [setup]
    bool wants(const Message& m) const {
        const std::string& list = receives.get();
        if (list == "all" || list == "none") return list == "all";
        return ("," + list + ",").find("," + m.name + ",") != std::string::npos;
    }
};

}  // namespace hal::scocan
