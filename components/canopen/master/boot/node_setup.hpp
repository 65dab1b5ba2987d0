// SPDX-License-Identifier: MIT
// What a master is told of its network, once: by a configuration file, a test, or code.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "canopen/protocol/sdo_client.hpp"
#include "object_writes.hpp"

namespace hal::canopen {

/// What to do about a node that does not boot or is lost.
enum class Reaction : std::uint8_t {
    nothing,    ///< it is reported; when it comes back by itself it is booted
    restart,    ///< it alone is booted again, as often as it takes, at growing intervals; the others go on
    stop_all,   ///< all nodes are stopped: the network has failed until start()
    reset_all,  ///< all nodes are reset and the network boots again; after MasterSetup::resets times: stop_all
};
const char* to_string(Reaction) noexcept;

/// The program of a node with a boot loader (CiA 302-3).
struct NodeProgram {
    std::uint8_t number = 1;             ///< sub-index of 1F50h, 1F51h, 1F56h, 1F57h
    std::uint32_t id = 0;                ///< what 1F56h shall say; 0: not checked
    std::string version{};               ///< what 100Ah shall say; empty: not checked
    bool update = false;                 ///< another one may be replaced by `image`
    std::vector<std::uint8_t> image{};   ///< for 1F50h
    Time limit = 60 * second;            ///< for erasing, for flashing, and for its restart, each
    bool checked() const noexcept { return id != 0 || !version.empty(); }
};

/// One node; the numbers in brackets are the objects and bits of CiA 302 that say the same.
struct NodeSetup {
    std::uint8_t id = 0;          ///< 1–127
    std::string name{};           ///< for messages; empty: only its number
    bool mandatory = true;        ///< the network is not operational without it (1F81h bit 3)
    bool configure = true;        ///< false: only watched and started (1F81h bit 2)
    bool keep_alive = false;      ///< one that is operational already is neither reset nor configured (1F81h bit 4)
    bool start = true;            ///< we start it; otherwise someone else does (1F80h bit 3)
    unsigned start_order = 0;     ///< nodes of a lower number are operational before it is started

    std::uint32_t device_type = 0, vendor = 0, product = 0, revision = 0, serial = 0;  ///< 0: not checked (1F84h–1F88h)
    std::vector<ObjectWrite> writes{};                    ///< its configuration (1F22h)
    std::uint32_t configuration_date = 0, configuration_time = 0;  ///< where 1020h says these, nothing is written (1F26h, 1F27h); 0: no
    bool restore = false;         ///< factory settings before it is configured (1011h; 1F81h bit 7)
    bool save = false;            ///< when something was written, it is saved (1010h)
    NodeProgram program{};            ///< (1F81h bits 5 and 6)
    Time sdo_timeout = 0;             ///< of this node; 0: MasterSetup::sdo
    int sdo_resends = -1;             ///< of this node; below 0: MasterSetup::sdo

    std::uint16_t heartbeat_ms = 100;   ///< what it shall produce (1017h); 0: its own, if any, counts
    Time heartbeat_limit = 0;           ///< silence that is a loss; 0: two and a half of its periods; < 0: it is not watched
    std::uint16_t guard_ms = 0;         ///< node guarding instead (100Ch); a node without 1017h is guarded at heartbeat_ms
    std::uint8_t guard_factor = 3;      ///< (100Dh)
    std::uint16_t master_limit_ms = 0;  ///< silence of the master's heartbeat after which the node acts as 1029h says (its 1016h); 0: none

    Time boot_limit = 10 * second;      ///< how long a mandatory node is waited for (1F89h)
    Time retry = 1 * second;            ///< between two tries; grows to retry_most while they fail
    Time retry_most = 10 * second;
    Reaction on_failure = Reaction::restart;  ///< it answers, but cannot be booted, or a mandatory one did not appear in time
    Reaction on_loss = Reaction::restart;     ///< it was operational and is not any more

    bool watched() const noexcept { return heartbeat_limit >= 0 && (heartbeat_ms != 0 || guard_ms != 0 || heartbeat_limit > 0); }
};

struct MasterSetup {
    std::uint8_t id = 127;              ///< our own node id: whose heartbeat the nodes watch; 0: we have none
    std::vector<NodeSetup> nodes{};
    bool start_all_at_once = false;     ///< one command to all, when all mandatory nodes are ready (1F80h bit 1)
    bool start_self = true;             ///< we become operational with the network; false: the application says when (1F80h bit 2)
    bool reset_at_start = true;         ///< communication of all nodes is reset first, except of those that are kept alive
    Time nmt_inhibit = 0;               ///< between two NMT commands (102Ah)
    unsigned parallel = 0;              ///< nodes booted at a time; 0: all
    unsigned resets = 3;                ///< how often Reaction::reset_all is done before the network is stopped instead
    SdoClientSettings sdo{};
};

/// What object 1F80h and, for one node, 1F81h of a master's DCF say. The nodes are there already. [setup]
void apply_startup(MasterSetup&, std::uint32_t object_1f80);
void apply_assignment(NodeSetup&, std::uint32_t object_1f81);

/// A sentence for each thing that cannot be: ids twice or out of range, our own id, writes without data …. [setup]
std::vector<std::string> problems_of(const MasterSetup&);

}  // namespace hal::canopen
