// SPDX-License-Identifier: MIT
// The serial stream of a JR3 force/torque sensor, as samples of its data line, one per clock:
//
//     idle 0 … | start pulse: ten 1, one 0 | 20 bits, most significant first: 4 address, 16 data | at least two 0
//
// Packets come without a pause, 34 clocks each at 2.2 MHz, addresses 0 to 15 one after the other: 64 705 a second, 4 044 of each.
// Address 0 is the supply voltage, 1–6 the raw readings Fx Fy Fz Mx My Mz, 7 the calibration memory, 8–15 are reserved.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace hal::canopen::jr3 {

inline constexpr double clock_hz = 2.2e6;
inline constexpr unsigned start_clocks = 10, gap_clocks = 3, packet_clocks = start_clocks + 1 + 20 + gap_clocks;
inline constexpr unsigned addresses = 16, supply_address = 0, first_force = 1, calibration_address = 7;
inline constexpr std::size_t memory_size = 4096;

struct Packet {
    std::uint8_t address = 0;
    std::int16_t value = 0;
};

/// Finds the packets in the stream, from wherever it begins. The first good one only shows where packets begin; a bit that does not
/// fit loses that again.
class Decoder {
public:
    /// True: packet() is a new one. [realtime]
    bool take(bool bit) noexcept;
    const Packet& packet() const noexcept { return packet_; }
    /// The last packet was where it had to be. [realtime]
    bool locked() const noexcept { return locked_; }
    std::uint32_t packets() const noexcept { return packets_; }
    std::uint32_t errors() const noexcept { return errors_; }  ///< pulses of a wrong length, gaps that are none
    void reset() noexcept { *this = {}; }

private:
    enum class State : std::uint8_t { idle, pulse, data, gap, stuck };
    void lose(State next) noexcept;

    State state_ = State::idle;
    std::uint8_t count_ = 0;
    std::uint32_t shift_ = 0, packets_ = 0, errors_ = 0;
    bool locked_ = false;
    Packet packet_;
};

/// A sensor's side of the line.
class Generator {
public:
    /// The value of address 0–6 or 8–15 from its next packet on. [realtime]
    void set(unsigned address, std::int16_t value) noexcept { values_[address % addresses] = value; }
    /// What address 7 tells byte by byte: address in the high byte (its low eight bits), content in the low byte. It stays where it is.
    void set_memory(std::span<const std::uint8_t, memory_size> memory) noexcept { memory_ = memory.data(); }
    /// The line at the next clock. [realtime]
    bool next() noexcept;
    /// The next clocks, eight to a byte, the first in the highest bit: how a recording is kept. [any]
    void fill(std::span<std::uint8_t> room) noexcept;

private:
    std::array<std::int16_t, addresses> values_{};
    const std::uint8_t* memory_ = nullptr;
    std::size_t place_ = 0;
    unsigned address_ = 0, clock_ = 0;
    std::uint32_t word_ = 0;
};

/// Puts the calibration memory together from the words of address 7. A word has only the low eight bits of its address; the pages
/// follow one another, and the memory begins where its signature comes by.
class MemoryReader {
public:
    /// True: the last byte came and the memory is whole; it may still be nonsense. [realtime]
    bool take(std::uint16_t word) noexcept;
    std::span<const std::uint8_t, memory_size> memory() const noexcept { return memory_; }

private:
    std::array<std::uint8_t, memory_size> memory_{};
    std::size_t next_ = 0;  // bytes in a row from the beginning
};

}  // namespace hal::canopen::jr3
