// SPDX-License-Identifier: MIT
// Captures of CAN frames: candump logs (text) and pcapng (Wireshark), reading and writing. All of
// it [setup].
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "link/can.hpp"

namespace hal::can {

#pragma GCC visibility push(default)

/// Returns the frame as a line of a log, `(1436509052.249713) can0 181#0102`, without the end of
/// line.
std::string log_line(const Frame&, std::string_view channel);
/// Parses such a line. Returns false for an invalid one. `time_ns` becomes that of the line.
bool parse_log_line(std::string_view line, Frame&);
/// Appends the frames of a log: of can-utils or python-can, or candump's terminal format with
/// times. Returns "", or the first line that is invalid and the reason; then the frames of the
/// other lines are appended all the same. A last line without an end is invalid: it may be cut off.
std::string parse_log(std::string_view text, std::vector<Frame>& frames);

/// The frames of a capture in order of time: candump log, pcapng or pcap, distinguished by the
/// first bytes. A truncated or damaged part ends the list, and `problem` has its place; it is empty
/// when all was read.
struct Capture {
    std::vector<Frame> frames;
    std::string problem;
};
/// Parses the bytes of a capture.
Capture parse_capture(std::string_view bytes);
/// Reads a capture from a file.
Capture read_capture(const std::string& file);

/// Writes a capture: pcapng if the name ends in .pcapng, otherwise a candump log.
class Recorder {
public:
    virtual ~Recorder() = default;
    /// Writes a frame. Returns false when the file cannot be written.
    virtual bool write(const Frame&) = 0;
    /// Flushes the file. Returns false when it cannot be written.
    virtual bool flush() = 0;
};
/// Creates a recorder. On failure returns nullptr and sets `problem`.
std::unique_ptr<Recorder> record(const std::string& file, std::string_view channel,
                                 std::string& problem);

#pragma GCC visibility pop

}  // namespace hal::can
