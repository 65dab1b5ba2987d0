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
    bool maps_registers = false;  ///< an FMMU leads to a register
    std::uint8_t open_ports = 0;  ///< a bit for each
    std::uint16_t station = 0;
    std::uint16_t alias = 0;  ///< the station address where the alias is not enabled
    /// logical addresses that its FMMUs map, [first, end)
    std::uint64_t first_logical = ~std::uint64_t{0};
    std::uint64_t end_logical = 0;
    std::int64_t due_ns = INT64_MAX;  ///< when it has work without a frame
    std::int64_t run_ns = INT64_MAX;  ///< when its application is to run, at the next frame
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
        return latches_ || slave.maps_registers;
    }

private:
    bool everyone_ = false;  ///< by position, by broadcast, or to all but one
    bool latches_ = false;  ///< a write to the receive times, 0900h
    std::uint64_t first_logical_ = ~std::uint64_t{0};
    std::uint64_t end_logical_ = 0;
    std::array<std::uint16_t, max_datagrams> stations_{};
    std::size_t station_count_ = 0;
};

}  // namespace hal::ethercat::esc
