// SPDX-License-Identifier: MIT
// FrameDecoder of a build without CANopen: only error frames have a meaning of their own.
#include "bus/can/error_frame.hpp"
#include "bus/can/frame_decoder.hpp"

namespace hal::tools {

DecodedFrame FrameDecoder::decode(const can::Frame& f) {
    if (!f.error) return {};
    return {FrameKind::error, error_frame_text(f)};
}

std::string service_name(std::uint32_t, bool) { return ""; }

}  // namespace hal::tools
