// SPDX-License-Identifier: MIT
// Ports on an Ethernet segment in memory, for its tests.
#pragma once

#include "link/segment.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace hal::ethernet::segment_world {

inline constexpr std::int64_t ms = 1'000'000;
inline constexpr std::int64_t us = 1'000;
inline constexpr std::int64_t minimum_ns = 84 * 80;       // a frame of 60 bytes at 100 Mbit/s
inline constexpr std::int64_t one_way_ns = 2 * minimum_ns + 2 * us;  // both lines and the switch

using Bytes = std::vector<std::uint8_t>;

inline std::unique_ptr<Port> open_or_fail(const std::string& address, const Options& o = {}) {
    auto opened = open(address, o);
    EXPECT_TRUE(opened) << opened.problem;
    return std::move(opened.port);
}
inline std::string fresh() {  // a segment of its own for every test
    static int count = 0;
    return "sim:segment" + std::to_string(++count);
}
inline Bytes frame_to(const Address& to, const Port& from, std::uint16_t type, Bytes payload) {
    Bytes f(to.begin(), to.end());
    f.insert(f.end(), from.address().begin(), from.address().end());
    f.push_back(static_cast<std::uint8_t>(type >> 8));
    f.push_back(static_cast<std::uint8_t>(type));
    f.insert(f.end(), payload.begin(), payload.end());
    return f;
}
struct Got {
    Bytes bytes;
    std::int64_t time_ns;
    std::uint8_t first() const { return bytes[14]; }
};
inline std::vector<Got> all(Port& port, std::int64_t now) {
    std::vector<Got> got;
    while (const auto a = port.receive(now)) {
        got.push_back({{a->bytes.begin(), a->bytes.end()}, a->time_ns});
    }
    return got;
}
inline std::string firsts(const std::vector<Got>& got) {
    std::string s;
    for (const auto& g : got) {
        s += static_cast<char>('0' + g.first());
    }
    return s;
}

}  // namespace hal::ethernet::segment_world
