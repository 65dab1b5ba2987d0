// SPDX-License-Identifier: MIT
// Shared by the can commands: opening an address, filters, listening.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cli/options.hpp"
#include "cli/signals.hpp"
#include "hal/clock.hpp"
#include "link/can.hpp"

namespace hal::tools {

/// A bus as used by a command. Create it before any other thread, because it takes the signals that
/// end the command.
struct Bus {
    StopRequest stop;
    std::unique_ptr<can::Link> link;
    std::vector<std::unique_ptr<can::Link>> more;  ///< further links, for several addresses

    /// Opens an address, with CAN FD where supported, and sets the filters in the form of --filter.
    /// Returns false after printing the reason.
    bool open(const Options&, const std::string& address, bool fd = true,
              std::span<const std::string> filters = {});
    /// Opens several addresses with the same filters.
    bool open(const Options&, std::span<const std::string> addresses,
              std::span<const std::string> filters);
    /// Prints the open buses on stderr.
    void announce(const Options&) const;
    bool is_capture() const { return link->description().transport == "capture"; }
};

/// Passes received frames to `take` in batches until `for_ns` (negative: no limit) is over, a
/// signal arrives, a capture ends, or `take` returns false. Calls `idle` between batches, about
/// every `slice_ns`.
void listen(Bus&, std::int64_t for_ns, const std::function<bool(std::span<const can::Frame>)>& take,
            std::int64_t slice_ns = 50'000'000, const std::function<void()>& idle = {});

/// Queues a frame, waiting at most 1 s for space. Returns false when the link did not take it; the
/// link has counted it.
bool send_with_timeout(Bus&, const can::Frame&);
/// Waits at most 1 s until all frames are sent. Returns the exit code, after printing how many of
/// `wanted` were not sent.
int finish_sending(Bus&, const Options&, std::uint64_t wanted);

/// Parses `123#1122AABB`, the format of candump. Returns false and sets `problem` for an invalid
/// frame.
bool parse_frame(std::string_view text, can::Frame&, std::string& problem);
/// Parses `181` or `180/780`; eight digits or a large number are an extended identifier. Returns
/// false and sets `problem`.
bool parse_filter(std::string_view text, can::Filter&, std::string& problem);
/// Returns `123`, `18FF0001` or `error`, as wide as the kind of identifier.
std::string id_text(const can::Frame&);
/// Returns the bytes, or `remote request, 4 bytes`.
std::string data_text(const can::Frame&, const char* separator);

/// Returns why another process cannot open this bus (it is in memory) and what to type instead;
/// empty: it can.
std::string out_of_reach(const can::Description&);

}  // namespace hal::tools
