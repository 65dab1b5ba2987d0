// SPDX-License-Identifier: MIT
// The objects that a PDO or SRDO carries, mapped bit by bit (CiA 301).
#pragma once

#include <cstdint>
#include <vector>

#include "dictionary.hpp"

namespace hal::canopen {

/// Returns a mask of the lowest `bits` bits, 0..64. [any]
constexpr std::uint64_t ones(unsigned bits) noexcept {
    return bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << bits) - 1;
}

/// The mapping of one PDO. All calls belong to one thread.
class Mapping {
public:
    /// Reserves space for `capacity` objects, 64 at most. [setup]
    explicit Mapping(std::size_t capacity);

    /// Returns Abort::none if `entry` (an entry of 1600h or 1A00h) can be mapped; `received`: to an
    /// RPDO, which may contain dummies. [realtime]
    static Abort check(Dictionary&, std::uint32_t entry, bool received) noexcept;
    /// Replaces the mapping by `entries`; on an abort it stays unchanged. [realtime]
    Abort build(Dictionary&, std::span<const std::uint32_t> entries, bool received) noexcept;
    /// Removes all entries. [realtime]
    void clear() noexcept {
        items_.clear();
        bits_ = 0;
    }

    /// Returns the number of entries. [any]
    std::size_t count() const noexcept { return items_.size(); }
    /// Returns the mapped length in bits. [any]
    unsigned bits() const noexcept { return bits_; }
    /// Returns the mapped length in bytes, rounded up. [any]
    std::uint8_t bytes() const noexcept { return static_cast<std::uint8_t>((bits_ + 7) / 8); }
    /// Returns true if the entry is mapped. [any]
    bool maps(const Entry& e) const noexcept;

    /// Returns the values as the data of a frame; its first byte is the least significant one.
    /// [realtime]
    std::uint64_t pack() const noexcept;
    /// Writes all values, then calls the handlers. [realtime]
    void unpack(std::uint64_t) const noexcept;

private:
    struct Item {
        Entry* entry = nullptr;  // nullptr: a dummy
        std::uint8_t first = 0;
        std::uint8_t bits = 0;
    };
    std::vector<Item> items_;  // reserved for capacity_
    std::size_t capacity_;
    unsigned bits_ = 0;
};

}  // namespace hal::canopen
