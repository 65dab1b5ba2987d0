// SPDX-License-Identifier: MIT
#include "journal/file_hash.hpp"

#include <array>
#include <cstdint>
#include <fmt/core.h>
#include <fstream>

namespace hal {

std::string file_hash(const std::string& path) {
    constexpr std::uint64_t basis = 0xcbf29ce484222325;
    constexpr std::uint64_t prime = 0x100000001b3;
    std::ifstream file(path, std::ios::binary);
    if (!file) return "";
    std::uint64_t hash = basis;
    std::array<char, 1 << 16> block;
    while (file) {
        file.read(block.data(), block.size());
        for (std::streamsize i = 0; i < file.gcount(); ++i) {
            hash = (hash ^ static_cast<unsigned char>(block[static_cast<std::size_t>(i)])) * prime;
        }
    }
    return file.bad() ? "" : fmt::format("{:016x}", hash);
}

}  // namespace hal
