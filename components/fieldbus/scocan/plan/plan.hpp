// SPDX-License-Identifier: MIT
// What a table guarantees: the load of its slots and the worst-case latency of each message, and
// beside it that of the same messages on plain CAN. Recycled slots are a gain that nobody is
// promised: they do not count. Everything is [setup].
//
// A private message waits at most for the longest gap between two turns of its slot. A shared
// message that is queued within a slot is offered to the controller from the next one on. At the
// begin of a slot all nodes compete, so that no frame of lower priority is in its way; it waits
// until the shared slots have carried every frame of higher priority that is queued until it
// starts. Frames start in a slot until the last start of the longest of them, so each slot carries
// at least that much.
#pragma once

#include <optional>
#include <vector>

#include "fieldbus/can_timing/response_time.hpp"
#include "fieldbus/scocan/config/table.hpp"

namespace hal::scocan::plan {

/// One message. Times in ns.
struct Latency {
    std::size_t message = 0;  ///< of the table
    bool priv = false;
    std::uint32_t turns = 1;  ///< of a private slot with several identifiers: how many share it
    Time gap = 0;  ///< private: longest time between two turns
    Time interference = 0;  ///< shared: frames of higher priority
    Time waiting = 0;  ///< shared: time without a usable slot
    Time released = 0;  ///< shared: worst instant, from the begin of a cycle
    Time frame = 0;
    Time worst = -1;  ///< from the event to the end of the frame; -1: unbounded
    Time deadline = 0;
    Time jitter = 0;  ///< of the reception of a message that is queued in time
    bool in_time = false;
    Time plain = -1;  ///< worst case on plain CAN; -1: unbounded
    Time plain_jitter = -1;
    bool plain_in_time = false;
};

struct Plan {
    std::uint32_t mode = 0;
    std::vector<Latency> latencies;  ///< by priority
    double private_load = 0;  ///< frames in private slots, share of the bus time
    double shared_load = 0;  ///< demand of shared messages
    double capacity = 0;  ///< of the shared slots
    double plain_load = 0;  ///< of all messages on plain CAN
    std::uint32_t private_slots = 0;
    std::uint32_t shared_slots = 0;  ///< in the first cycle
    bool fits = false;
};

/// Returns the message of the table whose period is missing for the analysis, if any: shared,
/// without period or event.
std::optional<std::size_t> unlimited(const Table&, std::uint32_t mode);
/// Computes the plan of a mode.
Plan plan_of(const Table&, std::uint32_t mode);
/// Returns the messages as plain CAN has them, in the order of the table.
std::vector<can_timing::Message> plain_messages(const Table&, std::uint32_t mode);

}  // namespace hal::scocan::plan
