// SPDX-License-Identifier: MIT
// Frames in files: candump's log (text) and pcapng (Wireshark). Reading and writing; all of it [setup].
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "link/can.hpp"

namespace hal::can {

#pragma GCC visibility push(default)

/// `(1436509052.249713) can0 181#0102` without the end of line.
std::string log_line(const Frame&, std::string_view channel);
/// One such line; false when it is none. `time_ns` is the line's.
bool parse_log_line(std::string_view line, Frame&);

/// The frames of a capture, by their times; candump log, pcapng or pcap, told apart by the first bytes. Bounded: what is cut off or
/// damaged ends the list, and `problem` says where; it is empty when all was read.
struct Capture {
    std::vector<Frame> frames;
    std::string problem;
};
Capture parse_capture(std::string_view bytes);
Capture read_capture(const std::string& file);

/// Writes a capture; the ending of the file's name (.pcapng, else a candump log) chooses the format.
class Recorder {
public:
    virtual ~Recorder() = default;
    /// False when the file could not be written.
    virtual bool write(const Frame&) = 0;
    virtual bool flush() = 0;
};
/// Nothing, and `problem`, when the file cannot be made.
std::unique_ptr<Recorder> record(const std::string& file, std::string_view channel, std::string& problem);

#pragma GCC visibility pop

}  // namespace hal::can
