// SPDX-License-Identifier: MIT
// SipHash-2-4 (Aumasson and Bernstein, 2012): a 64-bit tag of a message under a 128-bit key.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <span>

namespace hal::can::cane {

using Key = std::array<std::uint64_t, 2>;

/// Returns the tag of `bytes`. [any]
inline std::uint64_t siphash(const Key& key, std::span<const std::uint8_t> bytes) noexcept {
    std::uint64_t a = key[0] ^ 0x736f6d6570736575;
    std::uint64_t b = key[1] ^ 0x646f72616e646f6d;

    std::uint64_t c = key[0] ^ 0x6c7967656e657261;
    std::uint64_t d = key[1] ^ 0x7465646279746573;
    const auto round = [&]() noexcept {
        a += b;
        c += d;
        b = std::rotl(b, 13) ^ a;
        d = std::rotl(d, 16) ^ c;
        a = std::rotl(a, 32);
        c += b;
        a += d;
        b = std::rotl(b, 17) ^ c;
        d = std::rotl(d, 21) ^ a;
        c = std::rotl(c, 32);
    };
    const auto take = [&](std::uint64_t word) noexcept {
        d ^= word;
        round();
        round();
        a ^= word;
    };
    const std::size_t whole = bytes.size() / 8 * 8;
    const auto word_at = [&](std::size_t at, std::size_t count) noexcept {
        std::uint64_t word = 0;
        if (std::endian::native == std::endian::little && count == 8) {
            std::memcpy(&word, bytes.data() + at, 8);
            return word;
        }
        for (std::size_t n = 0; n < count; ++n) {
            word |= std::uint64_t{bytes[at + n]} << 8 * n;
        }
        return word;
    };
    for (std::size_t at = 0; at < whole; at += 8) {
        take(word_at(at, 8));
    }
    take(word_at(whole, bytes.size() - whole) | std::uint64_t{bytes.size() & 0xff} << 56);
    c ^= 0xff;
    for (int n = 0; n < 4; ++n) {
        round();
    }
    return a ^ b ^ c ^ d;
}

}  // namespace hal::can::cane
