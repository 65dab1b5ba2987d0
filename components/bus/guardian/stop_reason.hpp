// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>

namespace hal::bus {

/// Why a guardian stops devices. The texts of to_string() are in this order.
enum class StopReason : std::uint8_t {
    none,
    unload,     ///< the component ends
    fault,      ///< the thread was stopped, or has a fault
    estop,      ///< the pin estop
    heartbeat,  ///< no cycle has run
    death,      ///< the process has ended
};

/// Returns the text of a reason, for a message. [any]
constexpr const char* to_string(StopReason reason) noexcept {
    constexpr const char* texts[] = {"none",
                                     "the component is unloaded",
                                     "its function was stopped, or its thread has a fault",
                                     "the pin estop is TRUE",
                                     "no cycle has run",
                                     "the process has ended"};
    static_assert(sizeof texts / sizeof *texts == static_cast<std::size_t>(StopReason::death) + 1);
    return texts[static_cast<std::size_t>(reason)];
}

}  // namespace hal::bus
