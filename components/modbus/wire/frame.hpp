// SPDX-License-Identifier: MIT
// Frames around a PDU: RTU with a check sequence (serial line V1.02, clause 2.5.1), TCP with a
// header (messaging on TCP/IP V1.0b, clause 3.1.3).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "modbus/wire/pdu.hpp"

namespace hal::modbus {

enum class Framing : std::uint8_t { rtu, tcp };

inline constexpr std::size_t max_frame = 260;
/// All slaves execute a request to it, and none answers (serial line V1.02, clause 2.1).
inline constexpr std::uint8_t broadcast_unit = 0;
inline constexpr std::uint8_t max_unit = 247;  ///< the last address of a slave

/// CRC-16 of Modbus, polynomial A001h, start FFFFh; of a frame with its CRC it is 0. [any]
std::uint16_t crc16(std::span<const std::uint8_t> bytes) noexcept;

struct Frame {
    std::array<std::uint8_t, max_frame> bytes{};
    std::size_t size = 0;
    std::span<const std::uint8_t> span() const noexcept { return {bytes.data(), size}; }
};

/// Puts a PDU into a frame. `transaction` is for TCP only. [any]
Frame encode(Framing framing, std::uint8_t unit, std::uint16_t transaction,
             const Pdu& pdu) noexcept;

/// A frame that was found in received bytes.
struct Found {
    std::uint8_t unit = 0;
    std::uint16_t transaction = 0;
    std::span<const std::uint8_t> pdu{};
    std::size_t length = 0;  ///< of the whole frame
};

/// Whose frames are received.
enum class Role : std::uint8_t { answers, requests };

/// Returns the length of an RTU frame that begins with these bytes; 0: more bytes are needed, or
/// the function is unknown. [any]
std::size_t rtu_length(std::span<const std::uint8_t> bytes, Role role, bool huanyang) noexcept;

/// What the first received bytes are.
enum class Scan : std::uint8_t {
    incomplete,  ///< more bytes are needed
    valid,
    corrupt,  ///< the check sequence, the length or the header is wrong
};
/// Examines the first frame of received bytes. [any]
Scan scan(Framing framing, Role role, bool huanyang, std::span<const std::uint8_t> bytes,
          Found& found) noexcept;

/// Received bytes until they are a frame.
class ReceiveBuffer {
public:
    std::span<std::uint8_t> free_space() noexcept { return std::span(bytes_).subspan(size_); }
    void added(std::size_t count) noexcept { size_ += count; }
    void drop(std::size_t count) noexcept;
    void clear() noexcept { size_ = 0; }
    std::span<const std::uint8_t> span() const noexcept { return {bytes_.data(), size_}; }
    bool empty() const noexcept { return size_ == 0; }

private:
    std::array<std::uint8_t, 2 * max_frame> bytes_{};
    std::size_t size_ = 0;
};

}  // namespace hal::modbus
