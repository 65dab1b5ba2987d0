// SPDX-License-Identifier: MIT
// The state of a network as the master sees it: numbers that can be copied out of the cycle, and
// functions that format them as messages.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "canopen/protocol/events.hpp"
#include "node_setup.hpp"

namespace hal::canopen {

/// The step of the boot procedure (CiA 302-2) that a node is in.
enum class Step : std::uint8_t {
    off,              ///< the master was not started, or the node was removed
    queued,           ///< waits until fewer nodes boot (MasterSetup::parallel)
    resetting,        ///< communication was reset; the boot-up message is pending
    identifying,      ///< reads 1000h and 1018h
    checking_state,   ///< keep-alive: waits for the NMT state
    checking_program, ///< reads 1F56h or 100Ah
    updating,         ///< program download: 1F50h, 1F51h, 1F57h
    restoring,        ///< restores defaults by 1011h
    configuring,      ///< compares, writes and verifies objects
    saving,           ///< stores the configuration by 1010h
    watching,         ///< error control is set up; the first heartbeat is pending
    ready,            ///< booted; waits for its turn in the start order
    starting,         ///< NMT start was sent
    running,          ///< operational (or ready for good if another device starts it)
    waiting,          ///< boot failed or node lost; retried at NodeStatus::next_try
    failed,           ///< boot failed or node lost; not retried
    stopped,          ///< stopped by command, or with the whole network
};
/// Returns the step as a phrase, such as "checking its state". [any]
const char* to_string(Step) noexcept;

/// The result of a boot by its letter in CiA 302-2.
enum class BootResult : char {
    none = 0,             ///< not finished yet
    good = '-',
    not_listed = 'A',     ///< not in the network list
    no_answer = 'B',      ///< no response to the read of 1000h
    device_type = 'C',    ///< 1000h differs from 1F84h
    vendor = 'D',         ///< 1018h:1 differs from 1F85h
    no_heartbeat = 'E',   ///< no heartbeat while the state was checked
    no_guarding = 'F',    ///< no response to node guarding
    no_program = 'G',     ///< program objects or image missing
    no_update = 'H',      ///< wrong program, update not allowed
    update = 'I',         ///< program download failed
    configuration = 'J',  ///< configuration failed
    watching = 'K',       ///< no heartbeat at the start of error control
    was_operational = 'L',///< was already operational and continues: not a failure
    product = 'M',        ///< 1018h:2 differs from 1F86h
    revision = 'N',       ///< 1018h:3 differs from 1F87h
    serial = 'O',         ///< 1018h:4 differs from 1F88h
};
/// Returns the result as a phrase, such as "wrong vendor". [any]
const char* to_string(BootResult) noexcept;
/// Returns true if the boot succeeded. [any]
constexpr bool booted(BootResult r) noexcept {
    return r == BootResult::good || r == BootResult::was_operational;
}

/// The cause of a failure or loss, in more detail than the letter.
enum class Cause : std::uint8_t {
    none,
    no_response,       ///< SDO timeout
    not_sent,          ///< the bus accepted no frames from the master
    aborted,           ///< SDO abort, see NodeStatus::abort
    mismatch,          ///< NodeStatus::found instead of `expected`
    not_retained,      ///< written, but reads back as another value
    duplicate_id,      ///< two devices respond with this node ID
    restarting,        ///< rebooted repeatedly during the boot
    no_object,         ///< a required object is missing
    no_image,          ///< no program file to download
    flash,             ///< 1F57h reports an error; NodeStatus::found is its value
    flash_busy,        ///< 1F57h reports busy for longer than NodeProgram::limit
    heartbeat,         ///< heartbeat timeout
    guarding,          ///< node guarding timeout
    guard_toggle,      ///< node guarding responses whose toggle bit does not alternate
    /// a boot-up message that this master did not cause: power loss, reset, another NMT master
    boot_up,
    left_operational,  ///< an NMT state change that this master did not command
    not_started,       ///< did not become operational after NMT start
    commanded,         ///< stopped by command
    network,           ///< stopped because of another node
};

/// Bits of NodeStatus::notes: conditions that are not errors.
enum Note : std::uint8_t {
    note_guarded = 1,       ///< no 1017h: supervised by node guarding
    note_unsupervised = 2,  ///< neither heartbeat nor guarding: a loss will not be detected
    note_no_consumer = 4,   ///< no free entry in 1016h: cannot monitor the master
    note_duplicate_id = 8,  ///< more heartbeats than one node sends
    note_no_date = 16,      ///< 1020h is not usable
    note_kept = 32,         ///< was already operational and was not reset
    note_updated = 64,      ///< received a new program
};

/// The state of one node.
struct NodeStatus {
    std::uint8_t id = 0;
    Step step = Step::off;
    BootResult result = BootResult::none;  ///< of the last completed boot
    Cause cause = Cause::none;             ///< of the last failure or loss
    Step failed_in = Step::off;            ///< the step in which it occurred
    std::uint8_t notes = 0;                ///< bits of Note
    /// NMT command specifier that another device sent before the last loss; 0: none was received
    std::uint8_t foreign_command = 0;

    // Details of the last failure.
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    Abort abort = Abort::none;
    std::uint64_t expected = 0;
    std::uint64_t found = 0;  ///< up to 8 bytes of the values
    /// position in NodeSetup::writes, counted from 1; 0: none
    std::uint16_t write = 0;

    NmtState state = NmtState::initialising;  ///< as last received
    bool online = false;  ///< responding, not lost since
    bool operational = false;
    bool mandatory = false;
    std::uint32_t attempts = 0;  ///< boots since start()
    std::uint32_t retries = 0;  ///< boots repeated after a failure or loss
    std::uint32_t losses = 0;
    std::uint64_t boot_ups = 0;
    std::uint64_t sdo_retries = 0;
    std::uint64_t wrong_toggles = 0;
    std::uint64_t emergencies = 0;
    std::uint16_t written = 0;
    std::uint16_t compared = 0;  ///< objects in the last boot
    Time begun = 0;
    Time booted = 0;  ///< start and end of the last boot
    Time last_heard = 0;  ///< last frame received; 0: none yet
    Time next_try = 0;  ///< in Step::waiting: when the next boot starts
    Emergency emergency{};  ///< the newest emergency; time 0: none received yet
    std::uint8_t error_register = 0;  ///< 1001h as the newest emergency carried it

    /// Returns the time since the last frame of the node in ns; -1: none received yet. [any]
    Time age(Time now) const noexcept { return last_heard == 0 ? -1 : now - last_heard; }
};

/// The state of the whole network.
enum class NetworkState : std::uint8_t {
    off,
    booting,  ///< not all mandatory nodes are operational yet
    operational,  ///< all mandatory nodes are operational
    degraded,  ///< was operational; a mandatory node is lost or restarting
    stopped,  ///< stopped by command
    failed,  ///< stopped because of a node
};
/// Returns the state as a word. [any]
const char* to_string(NetworkState) noexcept;

/// Counters of the whole network.
struct NetworkStatus {
    NetworkState state = NetworkState::off;
    /// the node that prevents the network from being operational; 0: none
    std::uint8_t node = 0;
    std::uint16_t nodes = 0;
    std::uint16_t mandatory = 0;
    std::uint16_t operational = 0;
    std::uint16_t mandatory_operational = 0;
    std::uint16_t booting = 0;

    std::uint16_t failed = 0;
    std::uint32_t resets = 0;  ///< of the whole network
    std::uint64_t foreign_commands = 0;  ///< NMT commands of other devices
    Time begun = 0;
    Time operational_since = 0;
};

/// Returns what happened to a node and what to do about it, in one sentence; empty if nothing did.
/// [setup]
std::string sentence(const NodeSetup&, const NodeStatus&);
/// Returns the state of the network and its cause in one sentence; `of_node` is the state of
/// NetworkStatus::node. [setup]
std::string sentence(const MasterSetup&, const NetworkStatus&, const NodeStatus& of_node);
/// Returns the progress of the boot as one short line. [setup]
std::string progress(const NetworkStatus&);
/// Returns one sentence for each bit of NodeStatus::notes. [setup]
std::vector<std::string> note_sentences(const NodeSetup&, const NodeStatus&);

}  // namespace hal::canopen
