// SPDX-License-Identifier: MIT
// Faults of the firmware of an emulated slave, for tests and demonstrations.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "ethercat/wire/states.hpp"

namespace hal::ethercat::devices {

/// Faults on command. Written from any thread, read by the firmware.
struct FirmwareFaults {
    struct Rejections {
        std::atomic<std::uint16_t>& operator[](State s) noexcept {
            return codes[static_cast<unsigned>(s) & 15];
        }
        std::array<std::atomic<std::uint16_t>, 16> codes{};
    };
    /// AL status code with which a state is rejected; 0: accepted
    Rejections reject;
    std::atomic<std::uint16_t> fail{0};  ///< drops to SAFE-OP with this code, once
    std::atomic<std::int64_t> mailbox_delay_ns{0};  ///< minimum time to an answer
    std::atomic<std::int64_t> state_delay_ns{0};  ///< time that a state change takes
    std::atomic<bool> mailbox_dead{false};  ///< reads requests, answers none
};

}  // namespace hal::ethercat::devices
