// SPDX-License-Identifier: MIT
// Frames in the timeline of the program that uses a link (`hal trace`).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

/// Defined by a program that records timelines (runtime/execute/trace.hpp), null in others.
/// [realtime]
extern "C" [[gnu::weak, gnu::visibility("default")]] void hal_trace_frame(
    unsigned kind, std::uint32_t id, std::size_t bytes) noexcept;

namespace hal::link {

/// The kinds of docs/protocol.md, "trace".
enum FrameKind : unsigned {
    can_sent = 5,
    can_received = 6,
    ethernet_sent = 7,
    ethernet_received = 8
};

/// Reports a frame that the calling cycle sends or receives. [realtime]
inline void trace_frame(FrameKind kind, std::uint32_t id, std::size_t bytes) noexcept {
    if (hal_trace_frame) {
        hal_trace_frame(kind, id, bytes);
    }
}
/// The same for an Ethernet frame, which is identified by its type. [realtime]
inline void trace_frame(FrameKind kind, std::span<const std::uint8_t> frame) noexcept {
    if (hal_trace_frame && frame.size() >= 14) {
        hal_trace_frame(kind, std::uint32_t{frame[12]} << 8 | frame[13], frame.size());
    }
}

}  // namespace hal::link
