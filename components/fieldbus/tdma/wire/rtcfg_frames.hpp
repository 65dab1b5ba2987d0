// SPDX-License-Identifier: MIT
// The frames of RTcfg 1.8 (RTnet, Documentation/RTcfg), Ethertype 0x9022: the configuration of
// stations by a server.
//
//     Message m;                                    // a heartbeat of a client
//     m.id = Id::heartbeat, m.to = server, m.from = own;
//     const std::size_t length = encode(m, frame);  // 0: `frame` is too short
//     if (decode(received, m)) …                    // m.data points into `received`
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "tdma_frames.hpp"

namespace hal::tdma::rtcfg {

/// Frame IDs (RTcfg 1.8, Frame Formats).
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

inline constexpr std::uint8_t wants_stage_2 = 1;
inline constexpr std::uint8_t is_ready = 2;  ///< flags

/// The logical address of a station: its MAC address, from the Ethernet header, or an IPv4 address.
struct Logical {
    bool by_ip = false;
    std::array<std::uint8_t, 4> ip{};
    bool operator==(const Logical&) const = default;
};

/// The fields of all frames; `id` determines which are used.
struct Message {
    Id id = Id::heartbeat;
    Address to{};
    Address from{};
    /// stage 1; `client` also of announcements and dead stations
    Logical client, server;
    /// stage 1, announce new: fragments without an acknowledgement
    std::uint8_t burst = 4;
    std::uint8_t flags = 0;  ///< announcements, stage 2
    std::uint32_t active = 0;  ///< stage 2: stations
    std::uint16_t heartbeat_ms = 0;
    /// stage 2: bytes of all fragments; acknowledge: bytes received
    std::uint32_t length = 0;
    std::uint32_t offset = 0;  ///< fragment
    Address dead{};  ///< dead station: its MAC address
    /// stage 1, stage 2 and its fragments; points into the frame
    std::span<const std::uint8_t> data{};
};

/// Decodes an untrusted frame. Returns false when it is not an RTcfg frame or truncated. The data
/// of a fragment includes the padding of a short frame: the reader knows the remaining length.
/// [any]
bool decode(std::span<const std::uint8_t> frame, Message& out) noexcept;

/// Encodes a frame and returns its length in `out`, padded with zeros to the smallest frame; 0 when
/// it does not fit. [any]
std::size_t encode(const Message&, std::span<std::uint8_t> out) noexcept;

/// Returns the payload bytes of a stage 1 frame. [any]
inline std::size_t stage_1_bytes(const Message& m) noexcept {
    return 5 + (m.client.by_ip ? 8 : 0) + m.data.size();
}
/// Return the data bytes that fit into a stage 2 frame and into a fragment with `payload` bytes
/// after the Ethernet header. [any]
constexpr std::size_t stage_2_capacity(std::size_t payload) noexcept {
    return payload > 12 ? payload - 12 : 0;
}
constexpr std::size_t fragment_capacity(std::size_t payload) noexcept {
    return payload > 5 ? payload - 5 : 0;
}

}  // namespace hal::tdma::rtcfg
