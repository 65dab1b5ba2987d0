// SPDX-License-Identifier: MIT
// The serial stream of a JR3 force/torque sensor, as samples of its data line, one per clock:
//
//     idle 0 … | start pulse: ten 1, one 0 | 20 bits, most significant first: 4 address, 16 data | at least two 0
//
// Packets follow without a gap, 34 clocks each at 2.2 MHz, addresses 0 to 15 one after the other:
// 64 705 a second, 4 044 of each. Address 0 is the supply voltage, 1–6 the raw readings Fx Fy Fz Mx
// My Mz, 7 the calibration memory, 8–15 are reserved.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace hal::canopen::jr3 {

inline constexpr double clock_hz = 2.2e6;
inline constexpr unsigned start_clocks = 10;
inline constexpr unsigned gap_clocks = 3;

inline constexpr unsigned packet_clocks = start_clocks + 1 + 20 + gap_clocks;
inline constexpr unsigned addresses = 16;
inline constexpr unsigned supply_address = 0;
inline constexpr unsigned first_force = 1;

inline constexpr unsigned calibration_address = 7;
inline constexpr std::size_t memory_size = 4096;

struct Packet {
    std::uint8_t address = 0;
    std::int16_t value = 0;
};

/// Finds the packets in a stream, starting at any point of it. The first valid packet only
/// establishes the framing and is not returned; a bit that violates the framing discards it again.
class Decoder {
public:
    /// Takes one bit. Returns true when packet() is a new one. [realtime]
    bool take(bool bit) noexcept;
    const Packet& packet() const noexcept { return packet_; }
    /// Returns true while the framing is established. [realtime]
    bool locked() const noexcept { return locked_; }
    std::uint32_t packets() const noexcept { return packets_; }
    /// pulses of a wrong length, missing gaps
    std::uint32_t errors() const noexcept { return errors_; }
    void reset() noexcept { *this = {}; }

private:
    enum class State : std::uint8_t { idle, pulse, data, gap, stuck };
    void lose(State next) noexcept;

    State state_ = State::idle;
    std::uint8_t count_ = 0;
    std::uint32_t shift_ = 0;
    std::uint32_t packets_ = 0;
    std::uint32_t errors_ = 0;
    bool locked_ = false;
    Packet packet_;
};

/// Generates the line as a sensor does.
class Generator {
public:
    /// Sets the value of address 0..6 or 8..15 from its next packet on. [realtime]
    void set(unsigned address, std::int16_t value) noexcept {
        values_[address % addresses] = value;
    }
    /// Sets the memory sent on address 7, one byte per word: low eight bits of its address in the
    /// high byte, content in the low byte. The memory is not copied. [setup]
    void set_memory(std::span<const std::uint8_t, memory_size> memory) noexcept {
        memory_ = memory.data();
    }
    /// Returns the line at the next clock. [realtime]
    bool next() noexcept;
    /// Writes the next clocks, eight per byte, the first in the most significant bit: the format of
    /// a recording. [any]
    void fill(std::span<std::uint8_t> buffer) noexcept;

private:
    std::array<std::int16_t, addresses> values_{};
    const std::uint8_t* memory_ = nullptr;
    std::size_t index_ = 0;
    unsigned address_ = 0;
    unsigned clock_ = 0;
    std::uint32_t word_ = 0;
};

/// Assembles the calibration memory from the words of address 7. A word has only the low eight bits
/// of its address; pages follow one another, and the memory begins at its signature.

class MemoryReader {
public:
    /// Takes a word. Returns true when the memory is complete; its contents are not validated.
    /// [realtime]
    bool take(std::uint16_t word) noexcept;
    std::span<const std::uint8_t, memory_size> memory() const noexcept { return memory_; }

private:
    std::array<std::uint8_t, memory_size> memory_{};
    std::size_t next_ = 0;  // consecutive bytes from the beginning
};

}  // namespace hal::canopen::jr3
