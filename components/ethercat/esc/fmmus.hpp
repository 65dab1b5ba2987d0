// SPDX-License-Identifier: MIT
// The FMMUs of an emulated controller: logical addresses to its memory, to the bit (ETG.1000.4,
// clause 6.6).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace hal::ethercat::esc {

/// [realtime]
class Fmmus {
public:
    static constexpr unsigned max = 16;

    struct Unit {
        std::uint64_t first_bit = 0;
        std::uint64_t bits = 0;  ///< logical, in bits
        std::uint32_t physical_bit = 0;
        bool reads = false;
        bool writes = false;
        bool bytes = false;                     ///< whole bytes on both sides
    };

    void connect(const std::uint8_t* memory, unsigned count) noexcept {
        memory_ = memory;
        count_ = count;
    }
    void reset() noexcept {
        used_ = 0;
        first_ = ~std::uint64_t{0};
        end_ = 0;
        can_latch_ = false;
        overlap_ = false;
    }
    /// Takes the settings at 0600h-06FFh.
    void configure() noexcept;

    /// Returns whether an active FMMU maps a part of a datagram. Logical addresses in bytes.
    bool hit(std::uint64_t address, std::size_t length) const noexcept {
        return address < end_ && address + length > first_;
    }
    std::uint64_t first_address() const noexcept { return first_; }  ///< of the logical addresses
    std::uint64_t end_address() const noexcept { return end_; }  ///< the one behind them
    /// Returns whether an active FMMU writes 0900h, which latches the receive times.
    bool can_latch() const noexcept { return can_latch_; }
    const Unit* begin() const noexcept { return units_.data(); }
    const Unit* end() const noexcept { return units_.data() + used_; }
    /// Returns whether a byte is both read and written.
    bool overlap() const noexcept { return overlap_; }

private:
    const std::uint8_t* memory_ = nullptr;
    unsigned count_ = 0;
    unsigned used_ = 0;
    std::array<Unit, max> units_;  ///< active ones
    std::uint64_t first_ = ~std::uint64_t{0};
    std::uint64_t end_ = 0;
    bool can_latch_ = false;
    bool overlap_ = false;
};

}  // namespace hal::ethercat::esc
