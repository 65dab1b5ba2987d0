// SPDX-License-Identifier: MIT
// The fault messages of the canopen component, formatted before the first cycle: real-time code
// only hands over a pointer and a number.
#pragma once

#include <array>
#include <cstdio>
#include <string>

#include "canopen/master/boot/node_status.hpp"
#include "canopen/master/config/master_config.hpp"

namespace hal::canopen {

/// Fault messages of one node. "{}" stands for the number that is raised with the message, in
/// seconds. [setup]
struct NodeFaultMessages {
    std::string no_heartbeat, guarding, toggle, rebooted, reset, left, commanded, not_started,
        duplicate, suspected;
    std::array<std::string, 16> boot;  // by the result letter of CiA 302-2, A is 0

    explicit NodeFaultMessages(const config::Node& n) {
        const std::string node = "node " + std::to_string(n.setup.id) +
                                 (n.setup.name.empty() ? "" : " (" + n.setup.name + ")");
        const std::string safe = "; outputs set to safe values";
        const Time timeout = n.setup.heartbeat_limit > 0
                                 ? n.setup.heartbeat_limit
                                 : n.setup.heartbeat_ms * millisecond * 5 / 2;
        char seconds[40];
        std::snprintf(seconds, sizeof seconds, "%g", static_cast<double>(timeout) * 1e-9);
        no_heartbeat = node + ": no heartbeat for {} s (timeout " + seconds + " s)" + safe;
        guarding = node + ": no answer to node guarding for {} s" + safe;
        toggle = node + ": the toggle bit of its guarding answers does not change" + safe;
        rebooted = node + ": rebooted without a command from this master" + safe;
        reset = node + ": rebooted after an NMT reset from another device" + safe;
        left = node + ": left the operational state without a command from this master" + safe;
        commanded =
            node + ": left the operational state after an NMT command from another device" + safe;
        not_started = node + ": did not become operational after the start command" + safe;
        duplicate = node + ": duplicate node ID, two devices answer" + safe;
        suspected = node + ": more heartbeats than configured, two devices may have this node ID";
        for (char letter = 'A'; letter <= 'O'; ++letter) {
            boot[static_cast<std::size_t>(letter - 'A')] =
                node + ": boot failed: " + to_string(static_cast<BootResult>(letter)) +
                " (result " + letter + ")";
        }
    }

    /// Returns the message for a node that is lost. [realtime]
    const std::string& lost(const NodeStatus& s) const noexcept {
        const bool commanded_by_other = s.foreign_command != 0;
        switch (s.cause) {
        case Cause::guarding: return guarding;
        case Cause::guard_toggle: return toggle;
        case Cause::boot_up: return commanded_by_other ? reset : rebooted;
        case Cause::left_operational: return commanded_by_other ? commanded : left;
        case Cause::not_started: return not_started;
        case Cause::duplicate_id: return duplicate;
        default: return no_heartbeat;
        }
    }
    /// Returns true if the message for a loss has the time without a sign of life. [realtime]
    static bool has_silence(Cause cause) noexcept {
        switch (cause) {
        case Cause::guard_toggle:
        case Cause::boot_up:
        case Cause::left_operational:
        case Cause::not_started:
        case Cause::duplicate_id: return false;
        default: return true;
        }
    }
    /// Returns the message for a node that did not boot or start. [realtime]
    const std::string& not_booted(const NodeStatus& s) const noexcept {
        if (s.cause == Cause::not_started) return not_started;
        if (s.cause == Cause::duplicate_id) return duplicate;
        return boot[(static_cast<std::size_t>(s.result) - 'A') & 15];
    }
};

/// Fault messages of a TPDO of a node. [setup]
struct PdoFaultMessages {
    std::string late;                ///< its number: the timeout in seconds
    std::string short_pdo;           ///< its number: the length received in bytes
    bool short_raised = false;  ///< since the node was booted

    PdoFaultMessages(const config::Node& n, const config::Pdo& pdo) {
        char id[16];
        std::snprintf(id, sizeof id, "%03X", cob_id(pdo.cob));
        const std::string about = "node " + std::to_string(n.setup.id) + " (" + n.name + "): tpdo" +
                                  std::to_string(pdo.number) + " (" + id + ")";
        late = about + " not received for {} s";
        short_pdo = about + " has {} bytes, its mapped objects need " +
                    std::to_string(pdo.bytes()) +
                    "; pins keep their values; to see the mapping of the node: hal can pdo show";
    }
};

}  // namespace hal::canopen
