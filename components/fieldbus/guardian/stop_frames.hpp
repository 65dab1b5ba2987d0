// SPDX-License-Identifier: MIT
// The frames that stop the devices of a link, as a netlist declares them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "link/can.hpp"

namespace hal::guardian {

/// At most so many frames of each kind.
inline constexpr std::size_t max_frames = 32;

/// The frames of one link: on CAN or on Ethernet.
struct StopFrames {
    std::vector<can::Frame> can;
    std::vector<std::vector<std::uint8_t>> ethernet;
    /// CAN: what devices send once they have stopped; data of a received frame may be longer
    std::vector<can::Frame> confirmations;
    std::vector<std::string> texts;  ///< of the frames to send, as they were declared

    std::size_t size() const noexcept { return can.size() + ethernet.size(); }
};

/// Parses `201#0000,000#0200`: CAN frames as candump writes them, separated by commas. Returns the
/// problem, or "". [setup]
std::string parse_can_frames(std::string_view list, std::vector<can::Frame>& frames);

/// Parses the frames of a netlist: those of CAN, or whole Ethernet frames in hexadecimal digits,
/// from the destination address to the end of the payload, separated by commas; dots, colons and
/// hyphens between bytes are ignored. `confirmations` may be empty. Returns the problem, or "".
/// [setup]
std::string parse(std::string_view frames, std::string_view confirmations, StopFrames& parsed);

}  // namespace hal::guardian
