// SPDX-License-Identifier: MIT
// Who else sends, and how much: finds a station that babbles.
#pragma once

#include <array>

#include "setup.hpp"

namespace hal::tdma {

class Watch {
public:
    static constexpr std::size_t most_stations = 64;

    /// A frame came. [realtime]
    void heard(const Address&) noexcept;
    /// A cycle is over: who sent more than `limit` frames in it, and how many; nullptr: nobody. [realtime]
    const Address* babbler(std::uint32_t limit, std::uint32_t& frames) noexcept;
    void clear() noexcept { used_ = 0; }

private:
    struct Peer {
        Address       address{};
        std::uint32_t frames = 0;  // in this cycle
    };
    std::array<Peer, most_stations> peers_{};
    std::size_t                     used_ = 0;
    Address                         found_{};
};

}  // namespace hal::tdma
