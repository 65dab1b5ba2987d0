// SPDX-License-Identifier: MIT
// CAN messages as they lie in an Ethernet frame of type 0x9023. README.md has the layouts.
#pragma once

#include <cstdint>
#include <span>

#include "link/can.hpp"
#include "link/ethernet.hpp"
#include "siphash.hpp"

namespace hal::can::cane {

inline constexpr std::uint16_t ether_type = 0x9023;
inline constexpr std::size_t single_bytes = 5;       ///< of a single message before its data
inline constexpr std::size_t packed_header = 10;     ///< of a packed payload before its messages
inline constexpr std::size_t longest_message = 15;   ///< of a packed message
inline constexpr std::size_t counter_bytes = 8, tag_bytes = 8;  ///< of a signed one: behind its header, behind its messages
inline constexpr std::uint8_t packed_marker = 0xec, packed_version = 1, signed_version = 2;

enum class Format : std::uint8_t { single, packed };
enum class Order : std::uint8_t { big, little };  ///< of the COB-ID of a single message

/// Why bytes from outside are no messages.
enum class Wrong : std::uint8_t {
    none,
    cut,      ///< ends before what it announces
    form,     ///< no such message: a length beyond 8, an identifier beyond its bits
    version,  ///< another format than the one asked for, or another version of it
    check,    ///< the check sequence does not agree
    not_signed,  ///< a key is asked for, and it has no tag
    tag,         ///< it was made with another key, or changed
};

/// One message as the whole payload; the bytes written, which the driver of the segment pads with zeros. 0: no classic frame. [realtime]
std::size_t put_single(const Frame&, Order, std::span<std::uint8_t> room) noexcept;
Wrong get_single(std::span<const std::uint8_t> payload, Order, Frame&) noexcept;

/// One message of a packed payload; the bytes written, 0: no classic frame, or no room. [realtime]
std::size_t put_packed(const Frame&, std::span<std::uint8_t> room) noexcept;

/// Which sender a packed frame is of, and the how manieth to this destination.
struct Stamp {
    std::uint16_t session = 0;   ///< drawn by the sender when it opens its link
    std::uint16_t sequence = 0;
};

/// Puts the header of a packed payload before messages that lie there already. `whole` is the Ethernet frame from its destination to the
/// end of the last message. [realtime]
void close_packed(std::span<std::uint8_t> whole, std::uint8_t messages, Stamp) noexcept;

/// The same in two steps. First the header, with places for what finish_packed() writes when the frame leaves: of a signed one
/// `counter_bytes` lie behind the header and `tag_bytes` behind the last message. [realtime]
void begin_packed(std::span<std::uint8_t> whole, std::uint8_t messages, std::uint16_t session, bool is_signed) noexcept;
void finish_packed(std::span<std::uint8_t> whole, std::uint16_t sequence, std::uint64_t counter, const Key*) noexcept;
/// In the session of frames of services alone.
inline constexpr std::uint16_t services_alone = 0x8000;
bool is_service(std::span<const std::uint8_t> packed_whole) noexcept;  ///< [any]

/// Reads a packed frame. First open() of the whole, then next() for each message.
class Unpacker {
public:
    /// Everything is checked here: after `none` every next() gives a valid frame. [realtime]
    Wrong open(std::span<const std::uint8_t> whole, const Key* key = nullptr) noexcept;
    bool next(Frame&) noexcept;  ///< [realtime]
    Stamp stamp() const noexcept { return stamp_; }
    unsigned messages() const noexcept { return messages_; }
    std::uint64_t counter() const noexcept { return counter_; }  ///< of a signed frame

private:
    std::span<const std::uint8_t> rest_;
    unsigned messages_ = 0, left_ = 0;
    std::uint64_t counter_ = 0;
    Stamp stamp_;
};

/// CRC-16 with polynomial 0x1021, most significant bit first, going on from `crc`, 0xFFFF at the beginning. [realtime]
std::uint16_t crc16(std::span<const std::uint8_t>, std::uint16_t crc = 0xffff) noexcept;

}  // namespace hal::can::cane
