// SPDX-License-Identifier: MIT
// Which frames concern a controller. Most frames of a long line concern few of its slaves: the line
// compares both in memory of its own, and leaves the other controllers alone.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "ethercat/wire/frames.hpp"

namespace hal::ethercat::esc {

/// What concerns a controller. The controller writes it, its line reads it, both in one thread.
struct FrameInterest {
    bool powered = false;
    bool has_events = false;  ///< of 0210h that it adds to each datagram
    bool can_latch = false;  ///< a logical write can latch its receive times
    std::uint8_t open_ports = 0;  ///< a bit for each
    std::uint16_t station = 0;
    std::uint16_t alias = 0;  ///< the station address where the alias is not enabled
    /// logical addresses that its FMMUs map, [first, end)
    std::uint64_t first_logical = ~std::uint64_t{0};
    std::uint64_t end_logical = 0;
    std::int64_t due_ns = INT64_MAX;  ///< when it has work without a frame
    std::int64_t run_ns = INT64_MAX;  ///< when its application is to run, at the next frame
    /// of the line: the controller makes it false when a frame may go another way than before
    bool* ways_are_known = nullptr;

    /// Takes what decides the way of a frame.
    void follow(bool has_power, bool latches, std::uint8_t open) noexcept {
        if (powered == has_power && can_latch == latches && open_ports == open) {
            return;
        }
        powered = has_power;
        can_latch = latches;
        open_ports = open;
        if (ways_are_known != nullptr) {
            *ways_are_known = false;
        }
    }
};

/// What the datagrams of a frame address. Read once for the whole line.
class FrameAddresses {
public:
    static constexpr std::size_t max_datagrams = 128;

    /// [realtime]
    void read(std::span<const DatagramView> datagrams) noexcept;
    /// Returns whether the frame has something for a controller, when it ends there at
    /// `last_bit_ns`. [realtime]
    bool concern(const FrameInterest& slave, std::int64_t last_bit_ns) const noexcept {
        if (everyone_ || slave.has_events || last_bit_ns >= slave.due_ns ||
            last_bit_ns >= slave.run_ns) {
            return true;
        }
        if (first_logical_ < slave.end_logical && end_logical_ > slave.first_logical) return true;
        const auto end = stations_.begin() + static_cast<std::ptrdiff_t>(station_count_);
        return std::any_of(stations_.begin(), end, [&](std::uint16_t station) {
            return station == slave.station || station == slave.alias;
        });
    }
    /// Returns whether a controller is to note when the frame arrives at its ports. [realtime]
    bool need_arrival(const FrameInterest& slave) const noexcept {
        return latches_ || slave.can_latch;
    }
    /// Returns whether all controllers note when the frame arrives. [realtime]
    bool latch() const noexcept { return latches_; }

private:
    bool everyone_ = false;  ///< by position, by broadcast, or to all but one
    bool latches_ = false;  ///< a write to the receive times, 0900h
    std::uint64_t first_logical_ = ~std::uint64_t{0};
    std::uint64_t end_logical_ = 0;
    std::array<std::uint16_t, max_datagrams> stations_{};
    std::size_t station_count_ = 0;
};

}  // namespace hal::ethercat::esc
