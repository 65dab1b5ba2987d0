// SPDX-License-Identifier: MIT
// What a master knows of its network, as numbers that can be copied out of the cycle, and the same in words.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "canopen/protocol/events.hpp"
#include "node_setup.hpp"

namespace hal::canopen {

/// Where a node is on its way.
enum class Step : std::uint8_t {
    off,              ///< the master was not started, or the node was removed
    queued,           ///< waits until fewer nodes boot
    resetting,        ///< its communication was reset; its boot-up message is waited for
    identifying,      ///< 1000h, 1018h
    checking_state,   ///< keep-alive: is it operational?
    checking_program, ///< 1F56h, 100Ah
    updating,         ///< 1F50h, 1F51h, 1F57h
    restoring,        ///< 1011h
    configuring,      ///< its objects are compared, written and verified
    saving,           ///< 1010h
    watching,         ///< error control is set up; its first heartbeat is waited for
    ready,            ///< booted; waits for its turn to be started
    starting,         ///< was told to start
    running,          ///< operational (or ready for good where somebody else starts it)
    waiting,          ///< did not boot or was lost; tried again at `next_try`
    failed,           ///< did not boot or was lost, and is left alone
    stopped,          ///< by command, or because the network was stopped
};
const char* to_string(Step) noexcept;

/// The result of a boot by the letters of CiA 302.
enum class BootResult : char {
    none = 0,             ///< not finished yet
    good = '-',
    not_listed = 'A',     ///< it is not in the network list
    no_answer = 'B',      ///< to 1000h
    device_type = 'C',
    vendor = 'D',
    no_heartbeat = 'E',   ///< while its state was checked
    no_guarding = 'F',
    no_program = 'G',     ///< the objects or the image of its program are missing
    no_update = 'H',      ///< its program is another one and may not be replaced
    update = 'I',         ///< the download failed
    configuration = 'J',
    watching = 'K',       ///< no heartbeat at the start of error control
    was_operational = 'L',///< it was operational already and goes on: not a failure
    product = 'M',
    revision = 'N',
    serial = 'O',
};
const char* to_string(BootResult) noexcept;
constexpr bool booted(BootResult r) noexcept { return r == BootResult::good || r == BootResult::was_operational; }

/// Why, in more detail than the letter.
enum class Cause : std::uint8_t {
    none,
    silent,            ///< no answer
    unsent,            ///< it could not be asked: the bus took no frames from us
    aborted,           ///< `abort` says why
    differs,           ///< `found` instead of `expected`
    not_taken,         ///< written, but reads as something else
    doubled,           ///< two devices answer with this id
    restarting,        ///< it booted again and again while it was booted
    no_object,         ///< it lacks what is needed
    no_image,          ///< no program to download
    flash,             ///< 1F57h reported an error; `found` is its status
    flash_busy,        ///< 1F57h said busy for too long
    heartbeat,         ///< silent for its limit
    guarding,          ///< no answer to guarding
    guard_toggle,      ///< answers to guarding whose toggle bit did not change
    boot_up,           ///< it booted by itself: power loss, reset
    left_operational,  ///< its state changed, and not by us
    not_started,       ///< told to start, it did not become operational
    commanded,         ///< by command
    network,           ///< because of another node
};

/// Bits of NodeStatus::notes: what is not an error but should be known.
enum Note : std::uint8_t {
    note_guarded = 1,       ///< no 1017h: guarded instead
    note_unwatched = 2,     ///< neither heartbeat nor guarding: its loss will not be noticed
    note_no_consumer = 4,   ///< cannot watch the master (no room in 1016h)
    note_doubled = 8,       ///< more heartbeats than one node would send
    note_no_date = 16,      ///< 1020h cannot be used
    note_kept = 32,         ///< was operational and was not touched
    note_updated = 64,      ///< its program was replaced
};

struct NodeStatus {
    std::uint8_t id = 0;
    Step step = Step::off;
    BootResult result = BootResult::none;  ///< of the last boot that ended
    Cause cause = Cause::none;             ///< of the last failure or loss
    Step failed_in = Step::off;            ///< where it happened
    std::uint8_t notes = 0;
    // What it was about.
    std::uint16_t index = 0;
    std::uint8_t sub = 0;
    Abort abort = Abort::none;
    std::uint64_t expected = 0, found = 0; ///< up to 8 bytes of the values
    std::uint16_t write = 0;               ///< which of NodeSetup::writes, counted from 1; 0: none

    NmtState state = NmtState::initialising;  ///< as last heard
    bool online = false;                   ///< heard from, and not lost since
    bool operational = false;
    bool mandatory = false;
    std::uint32_t attempts = 0;            ///< boots begun since start()
    std::uint32_t retries = 0;             ///< boots begun again after a failure or loss
    std::uint32_t losses = 0;
    std::uint64_t boot_ups = 0, sdo_retries = 0, wrong_toggles = 0, emergencies = 0;
    std::uint16_t written = 0, compared = 0;  ///< objects, in the last boot
    Time begun = 0, booted = 0;            ///< when the last boot began; when it was over
    Time last_heard = 0;                   ///< 0: never
    Time next_try = 0;
    Emergency emergency{};                 ///< the newest; its time is 0 when there is none
    std::uint8_t error_register = 0;

    /// Since its last sign of life. [any]
    Time age(Time now) const noexcept { return last_heard == 0 ? -1 : now - last_heard; }
};

enum class NetworkState : std::uint8_t {
    off,
    booting,      ///< not all mandatory nodes are operational yet
    operational,  ///< they are
    degraded,     ///< they were; one is lost or restarting
    stopped,      ///< by command
    failed,       ///< stopped because of a node
};
const char* to_string(NetworkState) noexcept;

struct NetworkStatus {
    NetworkState state = NetworkState::off;
    std::uint8_t node = 0;          ///< which one keeps it from being operational; 0: none
    std::uint16_t nodes = 0, mandatory = 0, operational = 0, mandatory_operational = 0, booting = 0, failed = 0;
    std::uint32_t resets = 0;       ///< of the whole network
    std::uint64_t foreign_commands = 0;  ///< NMT commands of another master
    Time begun = 0, operational_since = 0;
};

/// What happened to a node and what to do about it, in one sentence; empty when there is nothing to say. [setup]
std::string sentence(const NodeSetup&, const NodeStatus&);
/// The same of the network. [setup]
std::string sentence(const MasterSetup&, const NetworkStatus&, const NodeStatus& of_node);
/// How far it is, as one short line that can be printed over and over. [setup]
std::string progress(const NetworkStatus&);
/// One line for each bit. [setup]
std::vector<std::string> note_sentences(const NodeSetup&, const NodeStatus&);

}  // namespace hal::canopen
