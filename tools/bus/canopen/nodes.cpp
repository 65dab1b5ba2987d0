// SPDX-License-Identifier: MIT
// `hal can nodes`: lists the nodes that send: states, age of the last heartbeat, newest
// emergencies. Sends nothing.
#include "bus/canopen/nodes.hpp"

#include <algorithm>
#include <deque>
#include <fmt/core.h>
#include <map>
#include <unistd.h>

#include "bus/can/bus.hpp"
#include "bus/canopen/objects.hpp"
#include "bus/json_text.hpp"
#include "canopen/protocol/emcy.hpp"
#include "canopen/protocol/numbers.hpp"
#include "cli/output.hpp"

namespace hal::tools {

namespace {

constexpr std::int64_t redraw_ns = 250'000'000;
constexpr std::size_t max_emergencies = 3;  // shown per node

struct Emergency {
    std::uint16_t code = 0;
    std::uint8_t error_register = 0;
    std::int64_t at = 0;
};

struct Heard {
    bool has_heartbeat = false;  ///< a heartbeat or a guarding response was received
    canopen::NmtState state = canopen::NmtState::initialising;
    std::int64_t last = 0;
    std::int64_t max = 0;  ///< time of the newest one; the longest interval
    std::uint64_t boot_ups = 0;
    std::uint64_t emergencies = 0;
    std::deque<Emergency> newest;
};

using Nodes = std::map<unsigned, Heard>;

void take(Nodes& nodes, const can::Frame& f) {
    if (f.own || !f.is_standard_data()) return;
    if (f.id > 0x700 && f.id < 0x780 && f.length == 1) {
        Heard& n = nodes[f.id & 0x7f];
        if (f.data[0] == 0) {
            ++n.boot_ups;
            n.max = 0;
        } else if (n.has_heartbeat && n.state != canopen::NmtState::initialising) {
            n.max = std::max(n.max, f.time_ns - n.last);
        }
        n.state = static_cast<canopen::NmtState>(f.data[0] & 0x7f);
        n.last = f.time_ns;
        n.has_heartbeat = true;
    } else if (f.id > 0x80 && f.id < 0x100 && f.length >= 3) {
        Heard& n = nodes[f.id & 0x7f];
        ++n.emergencies;
        n.newest.push_front(
            {static_cast<std::uint16_t>(f.data[0] | f.data[1] << 8), f.data[2], f.time_ns});
        if (n.newest.size() > max_emergencies) {
            n.newest.pop_back();
        }
    }
}

double seconds(std::int64_t ns) { return static_cast<double>(ns) / 1e9; }

/// Returns true when no heartbeat was received for more than twice its longest interval.
bool is_offline(const Heard& n, std::int64_t now) {
    return n.max > 0 && now - n.last > 2 * n.max + 50'000'000;
}

std::string state_of(const Heard& n) {
    if (!n.has_heartbeat) return "no heartbeat";
    return n.state == canopen::NmtState::initialising ? "boot-up" : canopen::to_string(n.state);
}

std::string emergency_text(const Emergency& e, std::int64_t now) {
    const std::string what =
        e.code == 0 ? "error reset"
                    : fmt::format("0x{:04X} {}", e.code, canopen::emergency_text(e.code));
    return fmt::format("{}, {:.1f} s ago", what, seconds(now - e.at));
}

std::string table(const Nodes& nodes, std::int64_t now) {
    std::string text = fmt::format("{:>4}  {:15}  {:>10}  {:>8}  {}\n", "node", "state", "heard",
                                   "boot-ups", "emergencies");
    for (const auto& [id, n] : nodes) {
        const std::string age =
            n.has_heartbeat ? fmt::format("{:.2f} s", seconds(now - n.last)) : "-";
        std::string line = fmt::format("{:>4}  {:15}  {:>10}  {:>8}  {}", id, state_of(n), age,
                                       n.boot_ups, n.emergencies);
        if (is_offline(n, now)) {
            line += fmt::format("; OFFLINE: heartbeats were {:.2f} s apart", seconds(n.max));
        }
        text += line + "\n";
        for (const Emergency& e : n.newest) {
            text += fmt::format("{:47}{}\n", "", emergency_text(e, now));
        }
    }
    return text;
}

std::string json(const Nodes& nodes, std::int64_t now) {
    std::string text;
    for (const auto& [id, n] : nodes) {
        std::string list;
        for (const Emergency& e : n.newest) {
            list += fmt::format(
                R"({}{{"code":{},"text":{},"error_register":{},"age":{:.3f}}})",
                list.empty() ? "" : ",", e.code,
                json_text(e.code == 0 ? "error reset" : canopen::emergency_text(e.code)),
                e.error_register, seconds(now - e.at));
        }
        text += fmt::format(
            R"({}{{"node":{},"state":"{}","age":{},"silent":{},"boot_ups":{},"emergencies":{},"newest":[{}]}})",
            text.empty() ? "[" : ",\n ", id, state_of(n),
            n.has_heartbeat ? fmt::format("{:.3f}", seconds(now - n.last)) : "null",
            is_offline(n, now), n.boot_ups, n.emergencies, list);
    }
    return (text.empty() ? "[" : text) + "]\n";
}

}  // namespace

int run_can_nodes(const NodesOptions& options) {
    Bus bus;
    if (!bus.open(options, options.words[0], false)) return 1;
    const bool live =
        !options.json && !options.once && ::isatty(STDOUT_FILENO) == 1 && !bus.is_capture();
    if (!live) {
        bus.announce(options);
    }
    Nodes nodes;
    std::int64_t newest = 0;
    std::int64_t drawn = 0;
    bool written = true;
    // A live list runs until Ctrl-C; a table takes as long as the slowest usual heartbeat.
    const std::int64_t for_ns = options.for_ns >= 0 || live ? options.for_ns : 2'000'000'000;
    const auto now = [&] { return bus.is_capture() ? newest : monotonic_ns(); };
    listen(bus, for_ns, [&](std::span<const can::Frame> batch) {
        for (const can::Frame& f : batch) {
            take(nodes, f);
            newest = std::max(newest, f.time_ns);
        }
        return written;
    }, redraw_ns, [&] {
        if (!live || monotonic_ns() - drawn < redraw_ns) return;
        drawn = monotonic_ns();
        written = print("\x1b[H\x1b[J" + table(nodes, drawn) +
                        (nodes.empty() ? "no node received yet\n" : ""));
        if (!written) {
            bus.stop.request();
        }
    });
    if (live) return exit_code(written);
    if (options.json) return exit_code(print(json(nodes, now())));
    if (nodes.empty()) {
        return fail(options,
                    fmt::format("no heartbeat and no emergency received within {:g} s; to query "
                                "every node: hal can scan {}",
                                seconds(std::max<std::int64_t>(for_ns, 0)), options.words[0]));
    }
    return exit_code(print(table(nodes, now())));
}

}  // namespace hal::tools
