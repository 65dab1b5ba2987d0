// SPDX-License-Identifier: MIT
// Which frames of a capture a master sent, and which returned from the slaves.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

namespace hal::ethercat {

/// Returns whether the source address of a frame has the mark that the first slave sets: bit 1 of
/// the first byte (ETG.1000.4, 5.3.2). [any]
constexpr bool is_marked(std::span<const std::uint8_t> frame) noexcept {
    constexpr std::size_t source = 6;
    return frame.size() > source && (frame[source] & 0x02) != 0;
}

/// Takes the EtherCAT frames of a capture in order. A frame without the mark of the first slave was
/// sent by a master. The mark distinguishes nothing when the address of the master has it already;
/// then the second of two frames with the same commands, indices and lengths has returned, and so
/// has one with a working counter. [setup]
class FrameDirections {
public:
    /// A frame that returned, with the number of the frame that was sent; `sent` of others is npos.
    struct Direction {
        static constexpr std::size_t npos = SIZE_MAX;
        bool returned = false;
        std::size_t sent = npos;  ///< of a frame that returned: number of the sent one, from 0
    };
    /// Takes the next frame, from its destination address on.
    Direction take(std::span<const std::uint8_t> frame);

private:
    /// A frame that was sent and has not returned.
    struct Waiting {
        std::size_t number = 0;
        std::vector<std::uint8_t> shape;
    };
    static constexpr std::size_t max_waiting = 64;

    std::deque<Waiting> waiting_;
    std::size_t frames_ = 0;
    bool unmarked_seen_ = false;
};

}  // namespace hal::ethercat
