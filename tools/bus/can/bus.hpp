// SPDX-License-Identifier: MIT
// What the can commands share: opening an address, filters, listening until it is enough.
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
#include "link/can.hpp"

namespace hal::tools {

/// A bus as a command uses it. Made before any other thread, because it takes the signals that end the command.
struct Bus {
    StopRequest stop;
    std::unique_ptr<can::Link> link;
    std::vector<std::unique_ptr<can::Link>> more;  ///< the further ones of several addresses

    /// Opens an address, with CAN FD where the bus has it, and sets the filters, as --filter takes them. False after saying why.
    bool open(const Options&, const std::string& address, bool fd = true, std::span<const std::string> filters = {});
    /// Opens several, with the same filters.
    bool open(const Options&, std::span<const std::string> addresses, std::span<const std::string> filters);
    /// Says on stderr what is listened to, once it is.
    void announce(const Options&) const;
    bool is_capture() const { return link->description().transport == "capture"; }
};

/// Hands over what comes, in batches, until `for_ns` (negative: no limit) is over, somebody ends it, a capture is at its end, or `take`
/// returns false. `idle` is called between batches, about every `slice_ns`.
void listen(Bus&, std::int64_t for_ns, const std::function<bool(std::span<const can::Frame>)>& take, std::int64_t slice_ns = 50'000'000,
            const std::function<void()>& idle = {});

/// Puts a frame into the queue, waiting for room at most a second. False: it was not taken, and the link has counted it.
bool send_patiently(Bus&, const can::Frame&);
/// Waits, at most a second, until all is sent. Returns the exit code, after saying what was not sent; `wanted`: how many should have been.
int finish_sending(Bus&, const Options&, std::uint64_t wanted);

/// `123#1122AABB`, as candump writes it. False, and `problem`, when it is none.
bool parse_frame(std::string_view text, can::Frame&, std::string& problem);
/// `181`, `180/780`, eight digits or a larger number: an extended one. False, and `problem`.
bool parse_filter(std::string_view text, can::Filter&, std::string& problem);
/// `123`, `18FF0001`, `error`; as wide as the kind of identifier.
std::string id_text(const can::Frame&);
/// The bytes, or `remote request, 4 bytes`.
std::string data_text(const can::Frame&, const char* separator);

std::int64_t now_ns();
/// Why a program of its own cannot use this bus, and what to type instead: it is one in memory. Empty: it can.
std::string out_of_reach(const can::Description&);

}  // namespace hal::tools
