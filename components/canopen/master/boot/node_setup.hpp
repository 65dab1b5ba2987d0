// SPDX-License-Identifier: MIT
// The set-up of a master: its network as a configuration file, a test or code describes it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "canopen/protocol/sdo_client.hpp"
#include "object_writes.hpp"

namespace hal::canopen {

/// The reaction to a node that does not boot or is lost.
enum class Reaction : std::uint8_t {
    nothing,    ///< report it; boot it when it responds again
    restart,  ///< boot it again until it succeeds, at growing intervals; the other nodes continue
    stop_all,  ///< stop all nodes; the network has failed until start()
    /// reset all nodes and boot the network again, MasterSetup::resets times; then stop_all
    reset_all,
};
/// Returns the reaction as a phrase. [any]
const char* to_string(Reaction) noexcept;

/// The program of a node with a boot loader (CiA 302-3).
struct NodeProgram {
    std::uint8_t number = 1;  ///< sub-index of 1F50h, 1F51h, 1F56h, 1F57h
    std::uint32_t id = 0;  ///< expected value of 1F56h; 0: not checked
    std::string version{};  ///< expected value of 100Ah; empty: not checked
    bool update = false;  ///< a different program is replaced by `image`
    std::vector<std::uint8_t> image{};  ///< the program, written to 1F50h
    /// timeout of erasing, of flashing and of the restart, each
    Time limit = 60 * second;
    /// Returns true if the program is checked at all. [any]
    bool checked() const noexcept { return id != 0 || !version.empty(); }
};

/// One node. The objects in brackets are those of CiA 302 with the same meaning.
struct NodeSetup {
    std::uint8_t id = 0;  ///< node ID, 1..127
    std::string name{};  ///< for messages; may be empty
    bool mandatory = true;  ///< the network is operational only with this node (1F81h bit 3)
    bool configure = true;  ///< false: only supervised and started (1F81h bit 2)
    bool keep_alive = false;  ///< not reset nor configured if already operational (1F81h bit 4)
    /// this master starts it; false: another device does (1F80h bit 3)
    bool start = true;
    unsigned start_order = 0;  ///< started once all nodes with lower numbers are operational

    /// 0: not checked (1F84h–1F88h)
    std::uint32_t device_type = 0;
    std::uint32_t vendor = 0;
    std::uint32_t product = 0;
    std::uint32_t revision = 0;
    std::uint32_t serial = 0;
    std::vector<ObjectWrite> writes{};  ///< its configuration (1F22h)
    /// nothing is written if 1020h has these values (1F26h, 1F27h); 0: not used
    std::uint32_t configuration_date = 0;
    std::uint32_t configuration_time = 0;
    /// restores factory settings before the configuration (1011h; 1F81h bit 7)
    bool restore = false;
    bool save = false;  ///< saves the configuration if anything was written (1010h)
    NodeProgram program{};  ///< (1F81h bits 5 and 6)
    /// SDO timeout of this node in ns; 0: that of MasterSetup::sdo
    Time sdo_timeout = 0;
    /// SDO repetitions of this node; below 0: those of MasterSetup::sdo
    int sdo_resends = -1;

    /// heartbeat producer time (1017h); 0: whatever the node has
    std::uint16_t heartbeat_ms = 100;
    /// heartbeat timeout in ns; 0: 2.5 periods; < 0: not supervised
    Time heartbeat_limit = 0;
    /// node guarding instead (100Ch); 0: only if the node has no 1017h, every heartbeat_ms
    std::uint16_t guard_ms = 0;
    std::uint8_t guard_factor = 3;  ///< life time factor (100Dh)
    /// timeout of the master's heartbeat in the node (1016h), which then acts by 1029h; 0: none
    std::uint16_t master_limit_ms = 0;

    Time boot_limit = 10 * second;  ///< boot timeout of a mandatory node (1F89h)
    /// interval between boots; doubles up to retry_max while they fail
    Time retry = 1 * second;
    Time retry_max = 10 * second;
    /// responds but cannot be booted, or a mandatory node missed boot_limit
    Reaction on_failure = Reaction::restart;
    Reaction on_loss = Reaction::restart;  ///< was operational and is lost

    /// Returns true if heartbeat or node guarding is supervised. [any]
    bool supervised() const noexcept {
        return heartbeat_limit >= 0 && (heartbeat_ms != 0 || guard_ms != 0 || heartbeat_limit > 0);
    }
};

/// The set-up of the whole network.
struct MasterSetup {
    /// node ID of the master, whose heartbeat the nodes monitor; 0: none
    std::uint8_t id = 127;
    std::vector<NodeSetup> nodes{};
    /// one NMT start to all nodes once all mandatory nodes are ready (1F80h bit 1)
    bool start_all_at_once = false;
    /// the master becomes operational with the network; false: the application decides (1F80h bit
    /// 2)
    bool start_self = true;
    /// resets the communication of all nodes first, except of keep-alive nodes
    bool reset_at_start = true;
    Time nmt_inhibit = 0;  ///< minimum interval between NMT commands in ns (102Ah)
    unsigned parallel = 0;  ///< nodes booted at the same time; 0: all
    /// resets by Reaction::reset_all before the network is stopped
    unsigned resets = 3;
    SdoClientSettings sdo{};
};

/// Applies object 1F80h (NMT startup) of a master's DCF to the set-up and to all its nodes. [setup]
void apply_startup(MasterSetup&, std::uint32_t object_1f80);
/// Applies object 1F81h (NMT slave assignment) to one node. [setup]
void apply_assignment(NodeSetup&, std::uint32_t object_1f81);

/// Returns a sentence for each invalid value: node IDs that are duplicate or out of range, writes
/// without data, …. [setup]
std::vector<std::string> problems_of(const MasterSetup&);

}  // namespace hal::canopen
