// SPDX-License-Identifier: MIT
// The frames of the discipline itself: SYNC, the announcement of an idle slot, and the
// configuration messages. Source: facts can-timing.md 1.2; the paper names the identifiers 0 and 1
// only.
#pragma once

#include <cstdint>

#include "fieldbus/scocan/config/table.hpp"
#include "link/can.hpp"

namespace hal::scocan {

/// SYNC, identifier 0: begins a cycle.
struct Sync {
    /// false: DLC 0, from a simple sender: counter and mode are unknown
    bool numbered = false;
    std::uint8_t counter = 0;  ///< of the cycle, modulo 64
    std::uint8_t mode = 0;     ///< 0..15
    std::uint8_t sender = 0;   ///< 0: the primary; 1..7: backup
    bool pending = false;      ///< a mode change takes place at the announced counter
};
can::Frame encode(const Sync&) noexcept;
/// Returns false for a frame that is not a valid SYNC. [realtime]
bool decode(const can::Frame&, Sync&) noexcept;

/// Identifier 1, DLC 1: the private slot is idle; the rest of it is shared.
can::Frame announcement(std::uint32_t slot) noexcept;
/// Returns false for a frame that is not a valid announcement. [realtime]
bool decode_announcement(const can::Frame&, std::uint32_t& slot) noexcept;

/// Configuration, identifier 0x781 + sender, DLC 5: from the SYNC sender to all nodes, or from the
/// monitor to one (silence, resume).
struct Request {
    enum class What : std::uint8_t { table = 0, prepare = 1, cancel = 2, silence = 3, resume = 4 };
    std::uint32_t sender = 0;     ///< node, by the sender's table
    What what = What::table;
    std::uint8_t mode = 0;        ///< silence, resume: the node
    std::uint16_t crc = 0;        ///< of the sender's table
    std::uint8_t at_counter = 0;  ///< prepare: cycle of the switch
};
can::Frame encode(const Request&) noexcept;
/// Returns false for an invalid frame. [realtime]
bool decode(const can::Frame&, Request&) noexcept;

/// Answer, identifier 0x781 + node, DLC 4.
struct Answer {
    /// offline: no answer
    enum class Reason : std::uint8_t { ready = 0, unknown_mode = 1, offline = 2 };
    std::uint32_t node = 0;
    std::uint8_t mode = 0;
    Reason reason = Reason::ready;
    std::uint16_t crc = 0;  ///< of this node's table
};
can::Frame encode(const Answer&) noexcept;
/// Returns false for an invalid frame. [realtime]
bool decode(const can::Frame&, Answer&) noexcept;

}  // namespace hal::scocan
