// SPDX-License-Identifier: MIT
// A smart-serial device like Mesa's 7I76: 32 inputs, 16 outputs, an analogue output for a spindle.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace hal::mesa {

/// Describes itself in tables in its memory, and exchanges process data. Its outputs go off when
/// there was no exchange for 50 ms.
class Remote7i76 {
public:
    static constexpr std::uint32_t letters = '7' | 'I' << 8 | '7' << 16 | '6' << 24;
    static constexpr std::int64_t watchdog_ns = 50'000'000;
    static constexpr std::size_t words = 2;  ///< user registers of its process data

    /// [setup]
    explicit Remote7i76(std::uint32_t serial_number);

    std::uint32_t serial_number() const noexcept { return serial_number_; }
    /// The address of the table of process data in bits 0..15, of globals in 16..31.
    std::uint32_t tables() const noexcept { return tables_; }
    /// A request in a CS register: reads from the memory, or writes to it. [realtime]
    void serve(std::uint32_t request, std::span<std::uint32_t> user,
               std::span<const std::uint32_t> written) noexcept;
    /// Exchanges process data. [realtime]
    void exchange(std::span<std::uint32_t> in, std::span<const std::uint32_t> out,
                  std::int64_t now_ns) noexcept;
    /// Turns the outputs off when the watchdog has expired. [realtime]
    void watch(std::int64_t now_ns) noexcept;

    std::uint32_t inputs = 0;  ///< set by the plant: bit n is input n
    std::uint16_t outputs() const noexcept { return outputs_; }
    /// Of the spindle output, 0..1; 0 unless it is enabled.
    double spindle() const noexcept;
    bool is_reverse() const noexcept { return is_enabled_ && is_reverse_; }
    bool is_enabled() const noexcept { return is_enabled_; }

private:
    void append(std::vector<std::uint8_t> bytes);
    std::uint16_t append_table(const std::vector<std::uint16_t>& addresses);

    std::uint32_t serial_number_;
    std::uint32_t tables_ = 0;
    std::vector<std::uint8_t> memory_;
    std::int64_t exchanged_ns_ = 0;
    std::uint16_t outputs_ = 0;
    std::uint8_t speed_ = 0;
    bool is_enabled_ = false, is_reverse_ = false;
};

}  // namespace hal::mesa
