// SPDX-License-Identifier: MIT
#include "journal/file_hash.hpp"

#include <array>
#include <cstdint>
#include <fmt/core.h>
#include <fstream>
#include <string_view>

namespace hal {

namespace {

/// FNV-1a of 64 bits.
class Hash {
public:
    void add(std::string_view bytes) {
        constexpr std::uint64_t prime = 0x100000001b3;
        for (const char byte : bytes) {
            value_ = (value_ ^ static_cast<unsigned char>(byte)) * prime;
        }
    }
    std::string text() const { return fmt::format("{:016x}", value_); }

private:
    std::uint64_t value_ = 0xcbf29ce484222325;
};

}  // namespace

std::string file_hash(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    if (!file) return "";
    Hash hash;
    std::array<char, 1 << 16> block;
    while (file) {
        file.read(block.data(), block.size());
        hash.add({block.data(), static_cast<std::size_t>(file.gcount())});
    }
    return file.bad() ? "" : hash.text();
}

std::string text_hash(std::string_view bytes) {
    Hash hash;
    hash.add(bytes);
    return hash.text();
}

}  // namespace hal
