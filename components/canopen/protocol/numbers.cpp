// SPDX-License-Identifier: MIT
#include "numbers.hpp"

#include <array>

namespace hal::canopen {

const char* to_string(NmtState state) noexcept {
    switch (state) {
    case NmtState::initialising: return "initialising";
    case NmtState::stopped: return "stopped";
    case NmtState::operational: return "operational";
    case NmtState::pre_operational: return "pre-operational";
    }
    return "unknown";
}

namespace {
constexpr std::array<std::uint16_t, 256> crc_table = [] {
    std::array<std::uint16_t, 256> table{};
    for (unsigned byte = 0; byte < 256; ++byte) {
        unsigned crc = byte << 8;
        for (int bit = 0; bit < 8; ++bit) {
            crc = (crc & 0x8000) != 0 ? (crc << 1) ^ 0x1021 : crc << 1;
        }
        table[byte] = static_cast<std::uint16_t>(crc);
    }
    return table;
}();
}  // namespace

std::uint16_t crc16(std::span<const std::uint8_t> data, std::uint16_t crc) noexcept {
    for (const auto byte : data) {
        crc = static_cast<std::uint16_t>(crc << 8 ^ crc_table[(crc >> 8 ^ byte) & 0xff]);
    }
    return crc;
}

}  // namespace hal::canopen
