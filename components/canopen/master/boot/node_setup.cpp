// SPDX-License-Identifier: MIT
#include "node_setup.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

namespace hal::canopen {

const char* to_string(Reaction r) noexcept {
    switch (r) {
    case Reaction::nothing: return "nothing";
    case Reaction::restart: return "restart";
    case Reaction::stop_all: return "stop all";
    case Reaction::reset_all: return "reset all";
    }
    return "?";
}

void apply_startup(MasterSetup& setup, std::uint32_t object_1f80) {
    const auto bit = [&](unsigned n) { return (object_1f80 >> n & 1) != 0; };
    setup.start_all_at_once = bit(1);
    setup.start_self = !bit(2);
    for (auto& node : setup.nodes) {
        node.start = !bit(3);
        if (!node.mandatory) continue;
        if (bit(4)) {
            node.on_failure = node.on_loss = Reaction::reset_all;
        } else if (bit(6)) {
            node.on_failure = node.on_loss = Reaction::stop_all;
        }
    }
}

void apply_assignment(NodeSetup& node, std::uint32_t object_1f81) {
    const auto bit = [&](unsigned n) { return (object_1f81 >> n & 1) != 0; };
    node.configure = node.start = bit(2);
    node.on_loss = bit(2) ? Reaction::restart : Reaction::nothing;
    node.mandatory = bit(3);
    node.keep_alive = bit(4);
    node.program.update = bit(6);
    node.restore = bit(7);
    const auto guard_ms = static_cast<std::uint16_t>(object_1f81 >> 16);
    if (guard_ms == 0) return;
    node.guard_ms = guard_ms;
    node.guard_factor = static_cast<std::uint8_t>(object_1f81 >> 8);
}

std::vector<std::string> problems_of(const MasterSetup& setup) {
    std::vector<std::string> problems;
    const auto add = [&](const NodeSetup& n, const std::string& what) {
        problems.push_back("node " + std::to_string(n.id) + ' ' + what);
    };
    if (setup.id > 127) {
        problems.push_back("invalid node ID " + std::to_string(setup.id) +
                           " of the master; use 1 to 127");
    }
    std::array<bool, 256> seen{};
    for (const auto& n : setup.nodes) {
        if (n.id < 1 || n.id > 127) {
            add(n, "has an invalid node ID; use 1 to 127");
        } else if (n.id == setup.id) {
            add(n, "has the node ID of the master; change one of them");
        }
        if (seen[n.id]) {
            add(n, "is configured twice: duplicate node ID; change one of them");
        }
        seen[n.id] = true;
        for (const auto& w : n.writes) {
            if (!w.data.empty()) continue;
            std::array<char, 16> object{};
            std::snprintf(object.data(), object.size(), "%04X:%u", w.index, w.sub);
            add(n, "has no value for object " + std::string(object.data()) +
                       "; enter one or remove the object");
        }
        if (n.writes.size() > 60000) {
            add(n,
                "has " + std::to_string(n.writes.size()) + " objects to write; the limit is 60000");
        }
        if (n.master_limit_ms != 0 && setup.id == 0) {
            add(n, "is to monitor the master, which has no node ID; set one");
        }
        if (n.guard_ms != 0 && n.guard_factor == 0) {
            add(n, "has the life time factor 0; 3 is usual");
        }
        if (n.heartbeat_limit > 0 && n.heartbeat_limit <= n.heartbeat_ms * millisecond) {
            add(n, "has a heartbeat timeout of " + std::to_string(n.heartbeat_limit / millisecond) +
                       " ms, not longer than its heartbeat period of " +
                       std::to_string(n.heartbeat_ms) + " ms; use a longer timeout");
        }
        if (n.retry <= 0 || n.boot_limit <= 0) {
            add(n, "has an invalid retry interval or boot timeout; both must be above 0");
        }
    }
    return problems;
}

}  // namespace hal::canopen
