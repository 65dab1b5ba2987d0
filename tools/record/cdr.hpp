// SPDX-License-Identifier: MIT
// Common Data Representation, XCDR1, little-endian: the encoding of ROS 2 messages.
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>

namespace hal::tools {

/// Writes fields one after the other. Their alignment counts from behind the header.
class Cdr {
public:
    /// Replaces `to` by the header.
    explicit Cdr(std::string& to) : to_(to) { to.assign("\x00\x01\x00\x00", 4); }
    void byte(std::uint32_t value) { put(value, 1); }
    void word(std::uint32_t value) { put(value, 4); }
    void text(std::string_view value) {
        word(static_cast<std::uint32_t>(value.size() + 1));
        to_ += value;
        to_ += '\0';
    }
    void real(double value) { put(std::bit_cast<std::uint64_t>(value), 8); }

private:
    void put(std::uint64_t value, std::size_t bytes) {
        while ((to_.size() - 4) % bytes != 0) {
            to_ += '\0';
        }
        for (std::size_t k = 0; k < bytes; ++k) {
            to_ += static_cast<char>(value >> (8 * k));
        }
    }
    std::string& to_;
};

}  // namespace hal::tools
