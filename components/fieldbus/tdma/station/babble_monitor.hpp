// SPDX-License-Identifier: MIT
// Who else sends, and how much: finds a station that babbles. It goes by when frames arrived: a thread that begins late, or was held up,
// finds those of many cycles waiting, and nobody has babbled.
#pragma once

#include <array>

#include "station_setup.hpp"

namespace hal::tdma {

class BabbleMonitor {
public:
    static constexpr std::size_t most_stations = 64;

    /// A frame came at that time. [realtime]
    void heard(const Address&, Time arrived, Time cycle) noexcept;
    /// All that is there was heard: who sent more than `limit` frames within one cycle's time, and how many; nullptr: nobody. [realtime]
    const Address* babbler(std::uint32_t limit, std::uint32_t& frames) noexcept;
    void clear() noexcept { used_ = 0; }

private:
    struct Peer {
        Address       address{};
        Time          since = 0;             // a cycle's time begins with a frame
        std::uint32_t frames = 0, most = 0;  // in it, and in the fullest
    };
    std::array<Peer, most_stations> peers_{};
    std::size_t                     used_ = 0;
    Address                         found_{};
};

}  // namespace hal::tdma
