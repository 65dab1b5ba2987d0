// SPDX-License-Identifier: MIT
// `hal tdma status`: the stations of a segment as a running machine receives them.
#include "inspect/tdma_status.hpp"

#include <algorithm>
#include <cstdlib>
#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "cli/output.hpp"
#include "inspect/tdma_stations.hpp"
#include "text/quoting.hpp"

namespace hal::tools {

using nlohmann::json;
using Pins = StationPins;

namespace {

const char* state_of(const Pins& pins) {
    constexpr const char* words[] = {"listening", "synchronising", "calibrating",
                                     "running",   "withdrawn",     "unconfigured"};
    const auto state = static_cast<std::size_t>(number(pins, "state"));
    return state < std::size(words) ? words[state] : "?";
}

std::string since(double seconds) {
    if (seconds <= 0.0) return "-";
    return seconds < 120.0 ? fmt::format("{:.1f} s", seconds)
                           : fmt::format("{:.0f} min", seconds / 60.0);
}

/// "0: 300 us, 2: 400 us in 1 of 2 cycles"
std::string slots_of(const Pins& pins, const std::string& station) {
    const std::string begin = station + ".slot-";
    const std::string end = ".offset";
    std::map<int, std::string> slots;  // by their numbers: 10 is behind 2
    for (const auto& [name, value] : pins) {
        if (!name.starts_with(begin) || !name.ends_with(end) || !value.is_number()) continue;
        const std::string id = name.substr(begin.size(), name.size() - begin.size() - end.size());
        const double period = number(pins, begin + id + ".period");
        slots[std::atoi(id.c_str())] =
            fmt::format("{}: {:g} us{}", id, value.get<double>(),
                        period > 1.0 ? fmt::format(" in 1 of {:.0f} cycles", period) : "");
    }
    std::string text;
    for (const auto& [id, words] : slots) {
        append_item(text, words);
    }
    return text.empty() ? "-" : text;
}

/// Formats the state and the counters of a station in two lines.
std::string own_lines(const std::string& instance, const Pins& pins) {
    return fmt::format(
        "{}: {}{}, cycle {:.0f}; own clock {:+.1f} ppm to the master's, {:.2f} us to the master, "
        "jitter {:.2f} us\n"
        "{}: frames {:.0f} sent, {:.0f} late, {:.0f} dropped; syncs {:.0f}, {:.0f} lost; intruding "
        "{:.0f}, foreign {:.0f}\n",
        instance, state_of(pins), is_on(pins, "leading") ? " as master" : "", number(pins, "cycle"),
        number(pins, "drift"), number(pins, "delay"), number(pins, "jitter"), instance,
        number(pins, "frames-sent"), number(pins, "frames-late"), number(pins, "frames-dropped"),
        number(pins, "syncs"), number(pins, "syncs-lost"), number(pins, "frames-intruding"),
        number(pins, "frames-foreign"));
}

/// Formats the row of another station, whose pins begin with its name.
std::string station_row(const std::string& station, bool is_online, const Pins& pins) {
    const double frames = number(pins, station + ".frames");
    const char* state = frames == 0.0 ? "unheard" : "offline";
    if (is_online) {
        state = "online";
    }
    std::string drift = "-";
    if (is_on(pins, station + ".drift-known")) {
        drift = fmt::format("{:+.1f} ppm", number(pins, station + ".drift"));
    }
    return fmt::format("{:<16} {:<8} {:>9} {:>12.0f} {:>8.0f} {:>10}  {}\n", station, state,
                       since(number(pins, station + ".since")), frames,
                       number(pins, station + ".late"), drift, slots_of(pins, station));
}

/// Formats what a station knows of itself and of each other one. `pins` are those of its component,
/// without the name of the instance.
std::string rows(const std::string& instance, const Pins& pins) {
    std::string text = own_lines(instance, pins);
    text += fmt::format("{:<16} {:<8} {:>9} {:>12} {:>8} {:>10}  {}\n", "station", "state", "since",
                        "frames", "late", "drift", "slots");
    for (const auto& [name, value] : pins) {
        if (!name.ends_with(".online")) continue;
        const std::string station =
            name.substr(0, name.size() - std::string_view(".online").size());
        text += station_row(station, value.is_boolean() && value.get<bool>(), pins);
    }
    return text;
}

}  // namespace

double number(const Pins& pins, const std::string& name) {
    const auto pin = pins.find(name);
    return pin != pins.end() && pin->second.is_number() ? pin->second.get<double>() : 0.0;
}

bool is_on(const Pins& pins, const std::string& name) {
    const auto pin = pins.find(name);
    return pin != pins.end() && pin->second.is_boolean() && pin->second.get<bool>();
}

std::map<std::string, Pins> stations_of(Client& client, std::string& problem) {
    std::map<std::string, Pins> instances;
    const json reply = client.request({{"describe", "pin"}, {"patterns", json::array({"*"})}});
    if (!reply.value("ok", false)) {
        problem = reply.value("error", "no answer");
    }
    const json objects = reply.value("objects", json::array());
    // tdma.0.x.late is of the instance tdma.0, which has the pin tdma.0.state
    constexpr std::string_view marker = ".state";
    for (const json& pin : objects) {
        if (const std::string name = pin.value("name", "");
            pin.value("component", "") == "tdma" && name.ends_with(marker)) {
            instances[name.substr(0, name.size() - marker.size())];
        }
    }
    for (const json& pin : objects) {
        const std::string name = pin.value("name", "");
        for (auto& [instance, pins] : instances) {
            if (name.starts_with(instance + ".") && pin.contains("value")) {
                pins[name.substr(instance.size() + 1)] = pin["value"];
            }
        }
    }
    return instances;
}

std::string SegmentMachine::connect(const std::string& name) {
    std::string problem;
    client = Client::connect(instance_wanted(name), problem);
    if (!client) return problem;
    instances = stations_of(*client, problem);
    if (!problem.empty() || !instances.empty()) return problem;
    return fmt::format("instance '{}' has no station of a segment (loadrt tdma)",
                       client->instance());
}

int run_tdma_status(const TdmaStatusOptions& options) {
    if (!options.words.empty()) {
        return fail(options, fmt::format("unexpected '{}'; see: hal help tdma status",
                                         options.words.front()));
    }
    SegmentMachine machine;
    const std::string problem = machine.connect(options.name);
    if (!problem.empty()) return fail(options, problem);
    if (options.json) return exit_code(print(json(machine.instances).dump() + "\n"));
    std::string text;
    for (const auto& [instance, pins] : machine.instances) {
        text += rows(instance, pins);
    }
    return exit_code(print(text));
}

}  // namespace hal::tools
