// SPDX-License-Identifier: MIT
// The meaning of a frame in CANopen, by the predefined connection set; of a build without CANopen,
// of error frames alone.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "link/can.hpp"

namespace hal::tools {

enum class FrameKind : std::uint8_t {
    other,
    error,
    nmt,
    sync,
    time,
    emergency,
    pdo,
    sdo,
    heartbeat,
    lss
};

struct DecodedFrame {
    FrameKind kind = FrameKind::other;
    std::string text;  ///< empty: unknown
};

/// Decodes frames in the order of the bus: segments of a block transfer are recognised by the
/// preceding frames.
class FrameDecoder {
public:
    DecodedFrame decode(const can::Frame&);

private:
    struct Blocks {
        /// segments without a command come from the client, from the server
        bool down = false;
        bool up = false;
    };
    static std::string request_text(const can::Frame&, Blocks&);
    static std::string answer_text(const can::Frame&, Blocks&);
    DecodedFrame request(unsigned node, const can::Frame&);
    DecodedFrame answer(unsigned node, const can::Frame&);
    std::array<Blocks, 128> blocks_{};
};

/// Returns the service of an identifier: "TPDO1 of node 2".
std::string service_name(std::uint32_t id, bool extended);

}  // namespace hal::tools
