// SPDX-License-Identifier: MIT
// The frames of RTmac 2.0 and TDMA 2.1a (RTnet, Documentation/RTmac and Documentation/TDMA), Ethertype 0x9021. All fields big endian.
// What comes from the wire is taken as hostile: a frame is whole and of our versions, or it is nothing.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "link/ethernet.hpp"

namespace hal::tdma {

using Time = std::int64_t;  ///< ns
using ethernet::Address;

inline constexpr std::uint16_t rtmac_type = 0x9021, rtcfg_type = 0x9022, cane_type = 0x9023;  ///< Ethertypes
inline constexpr std::uint8_t  rtmac_version = 0x02;
inline constexpr std::uint16_t tdma_discipline = 0x0001, tdma_version = 0x0201;

inline constexpr std::size_t rtmac_bytes = 4;      ///< of the RTmac header, behind the Ethernet header
inline constexpr std::size_t sync_stamp_at = 26;   ///< places of the times of sending, for Launch::stamp_at
inline constexpr std::size_t request_stamp_at = 22;
inline constexpr std::size_t reply_stamp_at = 38;
inline constexpr std::size_t ping_stamp_at = 22, echo_stamp_at = 38;

/// Begins a cycle; from the master to all.
struct Sync {
    std::uint32_t cycle = 0;
    Time          stamp = 0;      ///< when it was sent, global time
    Time          scheduled = 0;  ///< when it should have been
};

/// A station asks the master for its times; the answer comes in the station's own slot.
struct Request {
    Time          stamp = 0;  ///< when it was sent, the station's clock
    std::uint32_t reply_cycle = 0;
    Time          reply_offset = 0;  ///< from that cycle's scheduled sync
};

struct Reply {
    Time request_stamp = 0;  ///< that of the request
    Time received = 0;       ///< when the master got it, global time
    Time stamp = 0;          ///< when the master sent this, global time
};

/// Not RTnet's: a station asks another one, in its own slot. Who does not know it counts a foreign frame, and does not answer.
struct Ping {
    Time          stamp = 0;  ///< when it was sent, the asking station's clock
    std::uint32_t number = 0;
};

/// The answer, in a slot of the station that was asked.
struct Echo {
    Time          ping_stamp = 0;  ///< that of the ping
    Time          received = 0;    ///< when the ping was there, and …
    Time          stamp = 0;       ///< … when this was sent, both on the answering station's clock
    std::uint32_t number = 0;      ///< that of the ping
};

/// A packet of another protocol, in a slot.
struct Tunnelled {
    std::uint16_t                 type = 0;  ///< its Ethertype
    std::span<const std::uint8_t> payload;
};

enum class Kind : std::uint8_t { none, sync, request, reply, tunnelled, ping, echo };

/// Why a frame is nothing to us.
enum class Defect : std::uint8_t {
    none,
    cut,         ///< shorter than what it says it is
    ethertype,   ///< another one
    version,     ///< of RTmac or TDMA
    discipline,  ///< RTmac, but not TDMA
    frame_id,    ///< a TDMA frame that does not exist
};

struct Decoded {
    Kind      kind = Kind::none;
    Defect    defect = Defect::none;
    Address   to{}, from{};
    Sync      sync;
    Request   request;
    Reply     reply;
    Tunnelled tunnelled;
    Ping      ping;
    Echo      echo;
};

/// Never reads beyond `frame`. [any]
Decoded decode(std::span<const std::uint8_t> frame) noexcept;

/// All of them fit the smallest frame.
using Frame = std::array<std::uint8_t, ethernet::smallest_frame>;

Frame encode(const Address& from, const Sync&) noexcept;                              ///< [any]
Frame encode(const Address& to, const Address& from, const Request&) noexcept;        ///< [any]
Frame encode(const Address& to, const Address& from, const Reply&) noexcept;          ///< [any]
Frame encode(const Address& to, const Address& from, const Ping&) noexcept;           ///< [any]
Frame encode(const Address& to, const Address& from, const Echo&) noexcept;           ///< [any]

/// An Ethernet frame as a tunnelled one, in `out`; its length, or 0 when it does not fit or is none. [any]
std::size_t tunnel(std::span<const std::uint8_t> frame, std::span<std::uint8_t> out) noexcept;
/// And back: the Ethernet frame that was tunnelled; 0 when `frame` is no tunnelled one. The padding of a short frame stays. [any]
std::size_t untunnel(std::span<const std::uint8_t> frame, std::span<std::uint8_t> out) noexcept;

}  // namespace hal::tdma
