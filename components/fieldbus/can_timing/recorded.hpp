// SPDX-License-Identifier: MIT
// The messages in a recording of a CAN bus, for the response-time analysis. [setup]
#pragma once

#include <span>
#include <vector>

#include "fieldbus/can_timing/response_time.hpp"
#include "link/can.hpp"

namespace hal::can_timing {

/// A message in a recording.
struct Recorded {
    Message message;
    std::size_t frames = 0;
    bool periodic = false;  ///< false: `period` is the shortest distance between two frames
};

/// Returns the messages of a recording, highest priority first, each with the length of its longest
/// frame. A message is periodic if its frames are within half a period of a regular grid; its
/// period is then that of the grid, and its jitter what the frames deviate from it, which includes
/// the time that they waited for the bus. Otherwise its period is the shortest distance between two
/// frames. A message seen once has the period 0. Error frames are ignored.
std::vector<Recorded> recorded(std::span<const can::Frame> frames);

}  // namespace hal::can_timing
