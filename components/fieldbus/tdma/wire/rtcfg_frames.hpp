// SPDX-License-Identifier: MIT
// The frames of RTcfg 1.8 (RTnet, Documentation/RTcfg), Ethertype 0x9022: how a server gives stations their configuration.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tdma_frames.hpp"

namespace hal::tdma::rtcfg {

enum class Id : std::uint8_t {
    stage_1,
    announce_new,
    announce_reply,
    stage_2,
    stage_2_fragment,
    acknowledge,
    ready,
    heartbeat,
    dead_station,
};
inline constexpr unsigned ids = 9;

inline constexpr std::uint8_t wants_stage_2 = 1, is_ready = 2;  ///< flags

/// How stations are told apart: by their MAC address, which the frame has anyway, or by an IPv4 address.
struct Logical {
    bool                        by_ip = false;
    std::array<std::uint8_t, 4> ip{};
    bool                        operator==(const Logical&) const = default;
};

/// Every field of every frame; which of them count says `id`.
struct Message {
    Id                            id = Id::heartbeat;
    Address                       to{}, from{};
    Logical                       client, server;       ///< stage 1; `client` also of announcements and dead stations
    std::uint8_t                  burst = 4;      ///< stage 1, announce new: fragments without an acknowledgement
    std::uint8_t                  flags = 0;      ///< announcements, stage 2
    std::uint32_t                 active = 0;     ///< stage 2: stations
    std::uint16_t                 heartbeat_ms = 0;
    std::uint32_t                 length = 0;     ///< stage 2: of all fragments; acknowledge: bytes that have come
    std::uint32_t                 offset = 0;     ///< fragment
    Address                       dead{};         ///< dead station: its MAC address
    std::span<const std::uint8_t> data{};  ///< stage 1, stage 2 and its fragments; points into the frame
};

/// Never reads beyond `frame`; false: it is none of these, or cut. A fragment's data includes the padding of a short frame: its reader
/// knows how much is missing. [any]
bool decode(std::span<const std::uint8_t> frame, Message& out) noexcept;

/// The length in `out`, at least the smallest frame, padded with zeros; 0 when it does not fit. [any]
std::size_t encode(const Message&, std::span<std::uint8_t> out) noexcept;

/// Behind the Ethernet header of a stage 1 frame. [any]
inline std::size_t stage_1_bytes(const Message& m) noexcept { return 5 + (m.client.by_ip ? 8 : 0) + m.data.size(); }
/// Bytes of data that a stage 2 frame and a fragment have room for in a frame with `payload` bytes behind the Ethernet header. [any]
constexpr std::size_t stage_2_room(std::size_t payload) noexcept { return payload > 12 ? payload - 12 : 0; }
constexpr std::size_t fragment_room(std::size_t payload) noexcept { return payload > 5 ? payload - 5 : 0; }

}  // namespace hal::tdma::rtcfg
