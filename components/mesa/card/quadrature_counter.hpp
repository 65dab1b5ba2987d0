// SPDX-License-Identifier: MIT
// An encoder input of an emulated card.
#pragma once

#include <cstdint>

namespace hal::mesa {

/// Counts edges in 16 bits, with the time stamp of the newest edge, and latches at the index. The
/// fields of its registers are in registers.hpp. [realtime]
class QuadratureCounter {
public:
    /// Edges from the position before to the new one.
    struct Motion {
        std::int64_t from = 0, to = 0;
        std::int64_t index_every = 0;  ///< edges between two index pulses; 0: none
        std::uint16_t last_edge = 0;   ///< time stamp of the newest edge
    };
    void move(const Motion& motion) noexcept;
    /// A and B change at the same time: the counter notes it until its control is written.
    void fail() noexcept;
    /// The level of the probe input; an edge may be latched.
    void set_probe(bool level) noexcept;

    std::uint32_t count_register() const noexcept {
        return std::uint32_t{count_} | std::uint32_t{last_edge_} << 16;
    }
    std::uint32_t control_register() const noexcept;
    void write_control(std::uint32_t value) noexcept;
    bool input_a() const noexcept { return ((position_ + 1) & 2) != 0; }
    bool input_b() const noexcept { return (position_ & 2) != 0; }
    bool input_index() const noexcept { return at_index_; }

private:
    void latch(std::uint16_t count, std::uint32_t arming) noexcept;
    void meet_index(std::int64_t at, const Motion& motion) noexcept;

    std::uint16_t count_ = 0;
    std::uint16_t last_edge_ = 0;
    std::uint16_t latch_ = 0;
    std::uint32_t control_ = 0;  ///< without the inputs
    std::int64_t position_ = 0;
    bool at_index_ = false;
    bool probe_ = true;  ///< pulled up
};

}  // namespace hal::mesa
