// SPDX-License-Identifier: MIT
// Captures of Ethernet frames: pcapng and pcap are read, pcapng is written. All of it [setup].
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "link/ethernet.hpp"

namespace hal::ethernet {

#pragma GCC visibility push(default)

/// A frame of a capture; its time is that of the file.
struct Captured {
    std::int64_t time_ns = 0;
    std::vector<std::uint8_t> bytes;
};

/// The Ethernet frames of a capture in order of time. A truncated or damaged part ends the list,
/// and `problem` has its place; it is empty when all was read. Incompletely captured frames, and
/// those longer than Ethernet's, are counted and left out.
struct Capture {
    std::vector<Captured> frames;
    std::size_t left_out = 0;
    std::string problem;
};
/// Parses the bytes of a capture.
Capture parse_capture(std::string_view bytes);
/// Reads a capture from a file.
Capture read_capture(const std::string& file);

/// Writes a capture that Wireshark reads.
class Recorder {
public:
    virtual ~Recorder() = default;
    /// Writes a frame. Returns false when the file cannot be written. `time_ns` counts from 1970 if
    /// Wireshark is to show a date.
    virtual bool write(std::int64_t time_ns, std::span<const std::uint8_t> frame) = 0;
    /// Flushes the file. Returns false when it cannot be written.
    virtual bool flush() = 0;
};
/// Creates a recorder. On failure returns nullptr and sets `problem`.
std::unique_ptr<Recorder> record(const std::string& file, std::string_view interface,
                                 std::string& problem);

#pragma GCC visibility pop

}  // namespace hal::ethernet
