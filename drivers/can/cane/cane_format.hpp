// SPDX-License-Identifier: MIT
// The coding of CAN messages in an Ethernet frame of type 0x9023. README.md has the layouts.
#pragma once

#include <cstdint>
#include <span>

#include "link/can.hpp"
#include "link/ethernet.hpp"
#include "siphash.hpp"

namespace hal::can::cane {

/// Ethertype of the frames.
inline constexpr std::uint16_t ether_type = 0x9023;
inline constexpr std::size_t single_bytes = 5;       ///< header of a single message
inline constexpr std::size_t packed_header = 10;     ///< header of a packed payload
inline constexpr std::size_t max_message_size = 15;   ///< longest packed message
/// of a signed frame: after its header, after its messages
inline constexpr std::size_t counter_bytes = 8;
inline constexpr std::size_t tag_bytes = 8;
inline constexpr std::uint8_t packed_marker = 0xec;
inline constexpr std::uint8_t packed_version = 1;
inline constexpr std::uint8_t signed_version = 2;

/// One message per frame, or many.
enum class Format : std::uint8_t { single, packed };
enum class Order : std::uint8_t { big, little };  ///< byte order of the COB-ID of a single message

/// Why a received frame is invalid.
enum class Wrong : std::uint8_t {
    none,
    cut,  ///< truncated
    form,  ///< invalid message: length above 8, identifier out of range
    version,  ///< differs from the configured format, or an unsupported version
    check,  ///< wrong check sequence
    not_signed,  ///< a key is configured, and the frame has no tag
    tag,  ///< made with another key, or modified
};

/// Writes one message as the whole payload. Returns the bytes written, which the driver of the
/// segment pads with zeros; 0 when the frame is not a classic one. [realtime]
std::size_t put_single(const Frame&, Order, std::span<std::uint8_t> out) noexcept;
/// Reads a single message. [realtime]
Wrong get_single(std::span<const std::uint8_t> payload, Order, Frame&) noexcept;

/// Appends one message to a packed payload. Returns the bytes written; 0 when the frame is not a
/// classic one or does not fit. [realtime]
std::size_t put_packed(const Frame&, std::span<std::uint8_t> out) noexcept;

/// Sender and sequence of a packed frame.
struct Stamp {
    std::uint16_t session = 0;  ///< drawn by the sender when it opens its link
    std::uint16_t sequence = 0;
};

/// Writes the header of a packed payload before messages already in place. `whole` is the Ethernet
/// frame from its destination to the end of the last message. [realtime]
void close_packed(std::span<std::uint8_t> whole, std::uint8_t messages, Stamp) noexcept;

/// Do the same in two steps: begin_packed() writes the header and leaves space for the fields that
/// finish_packed() writes when the frame is sent: in a signed frame, `counter_bytes` after the
/// header and `tag_bytes` after the last message. [realtime]
void begin_packed(std::span<std::uint8_t> whole, std::uint8_t messages, std::uint16_t session,
                  bool is_signed) noexcept;
void finish_packed(std::span<std::uint8_t> whole, std::uint16_t sequence, std::uint64_t counter,
                   const Key*) noexcept;
/// Bit of the session set in frames of only SDO, heartbeats and LSS.
inline constexpr std::uint16_t services_alone = 0x8000;
/// Returns true for such a frame. [any]
bool is_service(std::span<const std::uint8_t> packed_whole) noexcept;

/// Reads a packed frame: first open(), then next() for each message.
class Unpacker {
public:
    /// Validates the whole frame; after `none`, every next() gives a valid message. [realtime]
    Wrong open(std::span<const std::uint8_t> whole, const Key* key = nullptr) noexcept;
    bool next(Frame&) noexcept;  ///< Reads the next message; false at the end. [realtime]
    Stamp stamp() const noexcept { return stamp_; }
    unsigned messages() const noexcept { return messages_; }
    std::uint64_t counter() const noexcept { return counter_; }  ///< of a signed frame

private:
    std::span<const std::uint8_t> rest_;
    unsigned messages_ = 0;
    unsigned left_ = 0;
    std::uint64_t counter_ = 0;
    Stamp stamp_;
};

/// Continues the CRC-16 `crc` (polynomial 0x1021, most significant bit first, initial value
/// 0xFFFF). [realtime]
std::uint16_t crc16(std::span<const std::uint8_t>, std::uint16_t crc = 0xffff) noexcept;

}  // namespace hal::can::cane
