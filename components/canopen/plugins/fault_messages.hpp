// SPDX-License-Identifier: MIT
// The fault messages of the canopen component, formatted before the first cycle: real-time code
// only hands over a pointer and a number.
#pragma once

#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include "canopen/master/boot/node_status.hpp"
#include "canopen/master/config/master_config.hpp"
#include "canopen/master/cycle/event_rows.hpp"
#include "canopen/master/cycle/master_node.hpp"

namespace hal::canopen {

/// See the top of this file. A node is counted as in MasterConfig::nodes, a PDO as in
/// OwnNode::received.
class FaultMessages {
public:
    using Fault = bus::FaultTexts::Fault;

    /// Formats all messages. [setup]
    FaultMessages(const config::MasterConfig& config, const std::vector<Received>& received)
        : bus_(bus_event_rows, 0,
               [&](BusEvent, std::size_t, std::string_view name) {
                   return name == "own" ? std::to_string(config.node_id) : std::string("[bus]");
               }),
          nodes_(node_fault_rows, config.nodes.size(),
                 [&](NodeFault, std::size_t node, std::string_view name) {
                     if (node == config.nodes.size()) return std::string();
                     return name == "node" ? node_name(config.nodes[node])
                                           : timeout_of(config.nodes[node]);
                 }),
          boots_(boot_fault_rows, config.nodes.size() * results,
                 [&](BootFault, std::size_t subject, std::string_view name) {
                     const std::size_t node = subject / results;
                     if (node == config.nodes.size()) return std::string();
                     if (name == "node") return node_name(config.nodes[node]);
                     const auto letter = static_cast<char>('A' + subject % results);
                     if (name == "letter") return std::string(1, letter);
                     return std::string(to_string(static_cast<BootResult>(letter)));
                 }),
          pdos_(pdo_fault_rows, received.size(),
                [&](PdoFault, std::size_t pdo, std::string_view name) {
                    if (pdo == received.size()) return std::string();
                    const config::Pdo& of = *received[pdo].pdo;
                    if (name == "bytes") return std::to_string(of.bytes());
                    return pdo_name(config.nodes[received[pdo].node], of);
                }) {}

    /// Returns the message of an event that raises a fault. [realtime]
    const Fault& of(BusEvent event) const noexcept { return *bus_.of(event, 0); }
    /// [realtime]
    const Fault& of(NodeFault fault, std::size_t node) const noexcept {
        return *nodes_.of(fault, node);
    }
    /// [realtime]
    const Fault& of(PdoFault fault, std::size_t pdo) const noexcept {
        return *pdos_.of(fault, pdo);
    }

    /// Returns the message for a node that is lost. [realtime]
    const Fault& lost(std::size_t node, const NodeStatus& s) const noexcept {
        return of(loss(s), node);
    }
    /// Returns the message for a node that did not boot or start. [realtime]
    const Fault& not_booted(std::size_t node, const NodeStatus& s) const noexcept {
        if (s.cause == Cause::not_started) return of(NodeFault::not_started, node);
        if (s.cause == Cause::duplicate_id) return of(NodeFault::duplicate_id, node);
        const std::size_t result = (static_cast<std::size_t>(s.result) - 'A') % results;
        return *boots_.of(BootFault::failed, node * results + result);
    }

private:
    static constexpr std::size_t results = 16;  ///< letters of CiA 302-2, from A on

    static NodeFault loss(const NodeStatus& s) noexcept {
        const bool commanded_by_other = s.foreign_command != 0;
        switch (s.cause) {
        case Cause::guarding: return NodeFault::no_guarding;
        case Cause::guard_toggle: return NodeFault::guard_toggle;
        case Cause::boot_up: return commanded_by_other ? NodeFault::reset : NodeFault::rebooted;
        case Cause::left_operational:
            return commanded_by_other ? NodeFault::commanded : NodeFault::left_operational;
        case Cause::not_started: return NodeFault::not_started;
        case Cause::duplicate_id: return NodeFault::duplicate_id;
        default: return NodeFault::no_heartbeat;
        }
    }
    static std::string node_name(const config::Node& n) {
        return "node " + std::to_string(n.setup.id) +
               (n.setup.name.empty() ? "" : " (" + n.setup.name + ")");
    }
    static std::string timeout_of(const config::Node& n) {
        const Time timeout = n.setup.heartbeat_limit > 0
                                 ? n.setup.heartbeat_limit
                                 : n.setup.heartbeat_ms * millisecond * 5 / 2;
        char text[40];
        std::snprintf(text, sizeof text, "%g s", static_cast<double>(timeout) * 1e-9);
        return text;
    }
    static std::string pdo_name(const config::Node& n, const config::Pdo& pdo) {
        char id[16];
        std::snprintf(id, sizeof id, "%03X", cob_id(pdo.cob));
        return "node " + std::to_string(n.setup.id) + " (" + n.name + "): tpdo" +
               std::to_string(pdo.number) + " (" + id + ")";
    }

    bus::FaultTexts bus_, nodes_, boots_, pdos_;
};

}  // namespace hal::canopen
