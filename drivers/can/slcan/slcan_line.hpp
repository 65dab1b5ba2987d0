// SPDX-License-Identifier: MIT
// Frames as lines of ASCII: Lawicel's format, with the letters d D b B for CAN FD.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "link/can.hpp"

namespace hal::can::slcan {

inline constexpr std::size_t longest_line = 1 + 8 + 1 + 128 + 8 + 1;  // letter, identifier, length, data, time stamp, end
using Line = std::array<char, longest_line>;

/// A valid frame with its end of line; how many characters. [realtime]
std::size_t encode(const Frame&, Line&) noexcept;

/// Takes the characters of a line as they come. [realtime]
class Decoder {
public:
    enum class Found : std::uint8_t {
        nothing,  ///< within a line, or a line that says nothing of interest
        frame,
        status,   ///< the answer to F; see status()
        error,    ///< the other side refused something, or the line made no sense
    };
    Found take(char) noexcept;
    const Frame& frame() const noexcept { return frame_; }
    unsigned status() const noexcept { return status_; }

private:
    Found line(std::string_view) noexcept;
    std::array<char, longest_line> text_{};
    std::size_t size_ = 0;
    bool too_long_ = false;
    Frame frame_;
    unsigned status_ = 0;
};

/// "S6" for 500 kbit/s …; nullptr: the format has no word for this rate.
const char* rate_command(std::uint32_t bit_rate) noexcept;

}  // namespace hal::can::slcan
