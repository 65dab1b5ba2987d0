// SPDX-License-Identifier: MIT
// What a frame is in CANopen, in words; as far as the predefined connection set tells.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "link/can.hpp"

namespace hal::tools {

enum class FrameKind : std::uint8_t { other, error, nmt, sync, time, emergency, pdo, sdo, heartbeat, lss };

struct DecodedFrame {
    FrameKind kind = FrameKind::other;
    std::string text;  ///< empty: it has none
};

/// Reads frames in the order of the bus: what a segment of a block transfer is depends on what came before it.
class FrameDecoder {
public:
    DecodedFrame decode(const can::Frame&);

private:
    DecodedFrame request(unsigned node, const can::Frame&);
    DecodedFrame answer(unsigned node, const can::Frame&);
    struct Blocks {
        bool down = false, up = false;  ///< segments without a command come from the client, from the server
    };
    std::array<Blocks, 128> blocks_{};
};

/// By the identifier alone: "TPDO1 of node 2".
std::string service_name(std::uint32_t id, bool extended);
/// "402 drive", "401 I/O module", …: from object 1000h.
std::string profile_name(std::uint32_t device_type);

}  // namespace hal::tools
