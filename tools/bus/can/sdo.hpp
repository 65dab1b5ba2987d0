// SPDX-License-Identifier: MIT
// The little that a scan needs of SDO: values of up to four bytes, read from many nodes side by side. This is the seam behind which the
// protocol library's client can do the same.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>

#include "link/can.hpp"

namespace hal::tools {

class Reads {
public:
    struct Answer {
        std::uint8_t node = 0, sub = 0;
        std::uint16_t index = 0;
        bool asked = true;          ///< false: nobody asked, or it was answered already
        std::uint32_t abort = 0;    ///< not 0: why there is no value
        std::uint32_t value = 0;
    };
    std::function<void(const Answer&)> on_answer;

    /// Asks when all that was asked of this node before is answered.
    void ask(std::uint8_t node, std::uint16_t index, std::uint8_t sub);
    /// Sends what can be sent now, at most `frames`.
    void poll(can::Link&, unsigned frames);
    void handle(const can::Frame&);

private:
    struct Question {
        std::uint16_t index;
        std::uint8_t sub;
    };
    struct Node {
        std::deque<Question> questions;
        bool waits = false;  ///< for the answer to the first
    };
    std::array<Node, 128> nodes_;
};

}  // namespace hal::tools
