// SPDX-License-Identifier: MIT
// Frames as lines of ASCII: Lawicel's protocol, with the letters d D b B for CAN FD.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "link/can.hpp"

namespace hal::can::slcan {

// letter, identifier, length, data, time stamp, end
inline constexpr std::size_t max_line_length = 1 + 8 + 1 + 128 + 8 + 1;
using Line = std::array<char, max_line_length>;

/// Encodes a valid frame with its end of line. Returns the number of characters. [realtime]
std::size_t encode(const Frame&, Line&) noexcept;

/// Decodes the characters of the line one by one. [realtime]
class Decoder {
public:
    enum class Found : std::uint8_t {
        nothing,  ///< within a line, or a line without a frame or status
        frame,
        status,   ///< the response to F; see status()
        error,    ///< the adapter rejected a command, or the line is invalid
    };
    Found take(char) noexcept;
    const Frame& frame() const noexcept { return frame_; }
    unsigned status() const noexcept { return status_; }

private:
    Found line(std::string_view) noexcept;
    std::array<char, max_line_length> text_{};
    std::size_t size_ = 0;
    bool too_long_ = false;
    Frame frame_;
    unsigned status_ = 0;
};

/// Returns "S6" for 500 kbit/s …, or nullptr for an unsupported rate.
const char* rate_command(std::uint32_t bit_rate) noexcept;

}  // namespace hal::can::slcan
