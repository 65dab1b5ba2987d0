// SPDX-License-Identifier: MIT
// Finds a station that babbles, from the arrival times of frames: a thread that was delayed finds
// the frames of many cycles, none of which is babbling.
#pragma once

#include <array>

#include "station_setup.hpp"

namespace hal::tdma {

class BabbleMonitor {
public:
    static constexpr std::size_t max_stations = 64;

    /// Counts a frame that arrived at `arrived` (local ns). [realtime]
    void heard(const Address&, Time arrived, Time cycle) noexcept;
    /// Returns the station that sent most, if that is more than `limit` frames within one cycle,
    /// and sets `frames`; nullptr: none. [realtime]
    const Address* babbler(std::uint32_t limit, std::uint32_t& frames) noexcept;
    /// Forgets all frames. [realtime]
    void clear() noexcept { used_ = 0; }

private:
    struct Peer {
        Address address{};
        Time since = 0;  // local; a cycle begins with a frame
        std::uint32_t frames = 0;
        std::uint32_t max_frames = 0;  // in this cycle, and in the fullest one
    };
    std::array<Peer, max_stations> peers_{};
    std::size_t used_ = 0;
    Address found_{};
};

}  // namespace hal::tdma
