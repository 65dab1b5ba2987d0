// SPDX-License-Identifier: MIT
// A minimal SDO client for scans: reads values of up to four bytes from many nodes in parallel.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>

#include "link/can.hpp"

namespace hal::tools {

class ParallelReads {
public:
    struct Answer {
        std::uint8_t node = 0;
        std::uint8_t sub = 0;
        std::uint16_t index = 0;
        bool asked = true;          ///< false: unsolicited, or a duplicate response
        std::uint32_t abort = 0;    ///< abort code; 0: the value is valid
        std::uint32_t value = 0;
    };
    std::function<void(const Answer&)> on_answer;

    /// Queues a read; it is sent when the earlier ones of this node are done.
    void ask(std::uint8_t node, std::uint16_t index, std::uint8_t sub);
    /// Sends pending requests, at most `frames`.
    void poll(can::Link&, unsigned frames);
    void handle(const can::Frame&);

private:
    static bool decode(const can::Frame&, Answer&);

    struct Question {
        std::uint16_t index;
        std::uint8_t sub;
    };
    struct Node {
        std::deque<Question> questions;
        bool waits = false;  ///< for the response to the first
    };
    std::array<Node, 128> nodes_;
};

}  // namespace hal::tools
