// SPDX-License-Identifier: MIT
// Ethernet frames in files: pcapng and pcap are read, pcapng is written. All of it [setup].
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "link/ethernet.hpp"

namespace hal::ethernet {

#pragma GCC visibility push(default)

/// A frame of a capture; its time is the file's.
struct Captured {
    std::int64_t time_ns = 0;
    std::vector<std::uint8_t> bytes;
};

/// The Ethernet frames of a capture, by their times. Bounded: what is cut off or damaged ends the list, and `problem` says where; it
/// is empty when all was read. Frames of which the capture holds a part only, and those longer than Ethernet's, are counted and left out.
struct Capture {
    std::vector<Captured> frames;
    std::size_t left_out = 0;
    std::string problem;
};
Capture parse_capture(std::string_view bytes);
Capture read_capture(const std::string& file);

/// Writes a capture that Wireshark reads.
class Recorder {
public:
    virtual ~Recorder() = default;
    /// False when the file could not be written. `time_ns` counts from 1970, if Wireshark is to show a date.
    virtual bool write(std::int64_t time_ns, std::span<const std::uint8_t> frame) = 0;
    virtual bool flush() = 0;
};
/// Nothing, and `problem`, when the file cannot be made.
std::unique_ptr<Recorder> record(const std::string& file, std::string_view interface, std::string& problem);

#pragma GCC visibility pop

}  // namespace hal::ethernet
