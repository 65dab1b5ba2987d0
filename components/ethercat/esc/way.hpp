// SPDX-License-Identifier: MIT
// The way of a frame through a line, as long as nothing changes or disturbs it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "ethercat/esc/frame_interest.hpp"

namespace hal::ethercat::esc {

/// The ends of a line: where a master's ports are connected.
enum class End : std::uint8_t { primary, secondary };

/// The processing units in the order in which a frame reaches them.
struct Way {
    struct Visit {
        std::size_t slave = 0;
        const FrameInterest* interest = nullptr;
        std::int64_t after_ns = 0;  ///< since the frame entered the line
    };
    std::vector<Visit> visits;
    bool leads_out = false;  ///< false: the way is not a plain one, and only walking finds it
    End end = End::primary;  ///< where it leads out
    std::int64_t duration_ns = 0;
};

}  // namespace hal::ethercat::esc
