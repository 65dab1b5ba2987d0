// SPDX-License-Identifier: MIT
// States of the EtherCAT state machine (ETG.1000.6, clause 6.4.1).
#pragma once

#include <cstdint>

namespace hal::ethercat {

/// A state as AL control (0120h) and AL status (0130h) code it in bits 0-3.
enum class State : std::uint8_t { none = 0, init = 1, preop = 2, boot = 3, safeop = 4, op = 8 };

/// Bit 4 of AL status: the last change failed; of AL control: acknowledges that.
inline constexpr std::uint16_t al_error = 0x10;
/// Bit 5 of AL control and status: explicit device identification (ETG.1020).
inline constexpr std::uint16_t al_identify = 0x20;

/// Returns "INIT", "PRE-OP", "BOOT", "SAFE-OP", "OP" or "no state". [any]
constexpr const char* to_string(State state) noexcept {
    switch (state) {
    case State::init: return "INIT";
    case State::preop: return "PRE-OP";
    case State::boot: return "BOOT";
    case State::safeop: return "SAFE-OP";
    case State::op: return "OP";
    case State::none: break;
    }
    return "no state";
}

}  // namespace hal::ethercat
