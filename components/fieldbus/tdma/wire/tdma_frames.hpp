// SPDX-License-Identifier: MIT
// The frames of RTmac 2.0 and TDMA 2.1a (RTnet, Documentation/RTmac and Documentation/TDMA),
// Ethertype 0x9021. All fields are big endian. Received frames are untrusted: the decoder accepts a
// complete frame of these versions or nothing.
//
//     const Frame frame = encode(own, Sync{cycle, global_ns, scheduled_ns});
//     if (const Decoded d = decode(received); d.kind == Kind::sync) use(d.sync.scheduled);
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "link/ethernet.hpp"

namespace hal::tdma {

using Time = std::int64_t;  ///< ns
using ethernet::Address;

/// Ethertypes
inline constexpr std::uint16_t rtmac_type = 0x9021;
inline constexpr std::uint16_t rtcfg_type = 0x9022;
inline constexpr std::uint16_t cane_type = 0x9023;
inline constexpr std::uint8_t rtmac_version = 0x02;
inline constexpr std::uint16_t tdma_discipline = 0x0001;
inline constexpr std::uint16_t tdma_version = 0x0201;

/// of the RTmac header, behind the Ethernet header
inline constexpr std::size_t rtmac_bytes = 4;
/// offsets of the time stamps, for Launch::stamp_at
inline constexpr std::size_t sync_stamp_at = 26;
inline constexpr std::size_t request_stamp_at = 22;
inline constexpr std::size_t reply_stamp_at = 38;
inline constexpr std::size_t ping_stamp_at = 22;
inline constexpr std::size_t echo_stamp_at = 38;

/// Begins a cycle; broadcast by the master.
struct Sync {
    std::uint32_t cycle = 0;
    Time stamp = 0;  ///< transmission, global time
    Time scheduled = 0;  ///< scheduled transmission, global time
};

/// Calibration request of a station to the master; the reply is sent in the station's own slot.
struct Request {
    Time stamp = 0;  ///< transmission, on the station's clock
    std::uint32_t reply_cycle = 0;
    Time reply_offset = 0;  ///< from that cycle's scheduled sync
};

/// Calibration reply of the master.
struct Reply {
    Time request_stamp = 0;  ///< stamp of the request
    Time received = 0;  ///< reception of the request, global time
    Time stamp = 0;  ///< transmission of the reply, global time
};

/// Ping of a station to another, in its own slot. An extension of RTnet: other implementations
/// ignore it.
struct Ping {
    Time stamp = 0;  ///< transmission, on the sender's clock
    std::uint32_t number = 0;
};

/// Answer to a ping, in a slot of its receiver.
struct Echo {
    Time ping_stamp = 0;  ///< stamp of the ping
    Time received = 0;  ///< reception of the ping, on the answering station's clock
    Time stamp = 0;  ///< transmission, on the same clock
    std::uint32_t number = 0;  ///< number of the ping
};

/// A packet of another protocol, in a slot.
struct Tunnelled {
    std::uint16_t type = 0;  ///< its Ethertype
    std::span<const std::uint8_t> payload;
};

/// Kinds of frames.
enum class Kind : std::uint8_t { none, sync, request, reply, tunnelled, ping, echo };

/// Why a frame is rejected.
enum class Defect : std::uint8_t {
    none,
    cut,  ///< truncated
    ethertype,  ///< another Ethertype
    version,  ///< unsupported version of RTmac or TDMA
    discipline,  ///< RTmac with another discipline
    frame_id,  ///< unknown TDMA frame ID
};

/// A decoded frame; the member that `kind` names is valid.
struct Decoded {
    Kind kind = Kind::none;
    Defect defect = Defect::none;
    Address to{};
    Address from{};
    Sync sync;
    Request request;
    Reply reply;
    Tunnelled tunnelled;
    Ping ping;
    Echo echo;
};

/// Decodes an untrusted frame. [any]
Decoded decode(std::span<const std::uint8_t> frame) noexcept;

/// An encoded frame; each kind fits the smallest Ethernet frame.
using Frame = std::array<std::uint8_t, ethernet::smallest_frame>;

Frame encode(const Address& from, const Sync&) noexcept;  ///< [any]
Frame encode(const Address& to, const Address& from, const Request&) noexcept;  ///< [any]
Frame encode(const Address& to, const Address& from, const Reply&) noexcept;  ///< [any]
Frame encode(const Address& to, const Address& from, const Ping&) noexcept;  ///< [any]
Frame encode(const Address& to, const Address& from, const Echo&) noexcept;  ///< [any]

/// Encodes an Ethernet frame as a tunnelled one in `out` and returns its length; 0 when it is
/// invalid or does not fit. [any]
std::size_t tunnel(std::span<const std::uint8_t> frame, std::span<std::uint8_t> out) noexcept;
/// Decodes a tunnelled frame to the Ethernet frame in `out` and returns its length; 0 when it is
/// not tunnelled or does not fit. The padding of a short frame is kept. [any]
std::size_t untunnel(std::span<const std::uint8_t> frame, std::span<std::uint8_t> out) noexcept;

}  // namespace hal::tdma
