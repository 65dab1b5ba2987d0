// SPDX-License-Identifier: MIT
// CRC-32 as in zlib: polynomial 0xEDB88320, reflected.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

namespace hal::mcap {

namespace detail {
// Eight tables: eight bytes at a time.
inline constexpr auto crc_tables = [] {
    std::array<std::array<std::uint32_t, 256>, 8> tables{};
    for (std::uint32_t i = 0; i < 256; ++i) {
        std::uint32_t value = i;
        for (int bit = 0; bit < 8; ++bit) {
            value = (value >> 1) ^ (value & 1 ? 0xEDB88320u : 0);
        }
        tables[0][i] = value;
    }
    for (std::uint32_t i = 0; i < 256; ++i) {
        for (std::size_t k = 1; k < 8; ++k) {
            tables[k][i] = (tables[k - 1][i] >> 8) ^ tables[0][tables[k - 1][i] & 0xff];
        }
    }
    return tables;
}();
}  // namespace detail

/// Continues a CRC over more bytes; 0 begins one.
inline std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0) {
    const auto& t = detail::crc_tables;
    const auto at = [&](std::size_t i) {
        return std::uint32_t{static_cast<unsigned char>(bytes[i])};
    };
    std::uint32_t crc = ~before;
    std::size_t i = 0;
    for (; i + 8 <= bytes.size(); i += 8) {
        const std::uint32_t low =
            crc ^ (at(i) | at(i + 1) << 8 | at(i + 2) << 16 | at(i + 3) << 24);
        crc = t[7][low & 0xff] ^ t[6][(low >> 8) & 0xff] ^ t[5][(low >> 16) & 0xff] ^
              t[4][low >> 24] ^ t[3][at(i + 4)] ^ t[2][at(i + 5)] ^ t[1][at(i + 6)] ^
              t[0][at(i + 7)];
    }
    for (; i < bytes.size(); ++i) {
        crc = (crc >> 8) ^ t[0][(crc ^ at(i)) & 0xff];
    }
    return ~crc;
}

}  // namespace hal::mcap
