// SPDX-License-Identifier: MIT
// CAN in Ethernet frames: messages, stations, and links on a segment in memory.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <vector>

#include "link/can.hpp"
#include "link/segment.hpp"

namespace hal::can::cane::test {

using Address = ethernet::Address;
using Bytes = std::vector<std::uint8_t>;

inline Frame message(std::uint32_t id, std::initializer_list<std::uint8_t> data) {
    return {id, data};
}

inline constexpr Address a{2, 0, 0, 0, 0, 1};
inline constexpr Address b{2, 0, 0, 0, 0, 2};
inline constexpr Address c{2, 0, 0, 0, 0, 3};

inline std::unique_ptr<Link> opened(const std::string& address) {
    auto o = can::open(address);
    EXPECT_TRUE(o) << o.problem;
    return std::move(o.link);
}

inline std::vector<Frame> all_of(Link& link, std::int64_t now) {
    std::vector<Frame> frames;
    for (Frame f; link.receive(f, now);) {
        frames.push_back(f);
    }
    return frames;
}

}  // namespace hal::can::cane::test
