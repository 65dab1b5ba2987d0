// SPDX-License-Identifier: MIT
// Which objects a PDO carries, to the bit.
#pragma once

#include <cstdint>
#include <vector>

#include "dictionary.hpp"

namespace hal::canopen {

class Mapping {
public:
    /// `room`: how many objects it can ever hold, at most 64. [setup]
    explicit Mapping(std::size_t room);

    /// Whether `entry` (as in 1600h or 1A00h) can be carried; `received`: in an RPDO, where dummies are good, too. [realtime]
    static Abort check(Dictionary&, std::uint32_t entry, bool received) noexcept;
    /// Takes over `entries`; on an abort it stays as it was. [realtime]
    Abort build(Dictionary&, std::span<const std::uint32_t> entries, bool received) noexcept;
    void clear() noexcept { items_.clear(), bits_ = 0; }

    std::size_t count() const noexcept { return items_.size(); }
    unsigned bits() const noexcept { return bits_; }
    std::uint8_t bytes() const noexcept { return static_cast<std::uint8_t>((bits_ + 7) / 8); }
    bool maps(const Entry& e) const noexcept;

    /// The values as they lie in the frame; the first byte is the lowest. [realtime]
    std::uint64_t pack() const noexcept;
    /// Writes all values, then tells the handlers. [realtime]
    void unpack(std::uint64_t) const noexcept;

private:
    struct Item {
        Entry* entry = nullptr;  // nullptr: a dummy
        std::uint8_t first = 0, bits = 0;
    };
    std::vector<Item> items_;  // has the memory for `room` from the start
    std::size_t room_;
    unsigned bits_ = 0;
};

}  // namespace hal::canopen
