// SPDX-License-Identifier: MIT
// Access to a sampler's or streamer's FIFO through the control socket.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "control/client.hpp"
#include "hal/abi.h"
#include "inspect/stream_options.hpp"

namespace hal::tools {

/// The stream of `hal record` and `hal play`.
struct Stream {
    std::unique_ptr<Client> client;
    std::string name;             ///< of the instance: "sampler.0"
    std::vector<hal_type> types;  ///< of the columns
    bool timed = false;           ///< its records carry the time of their cycle
    std::string file;             ///< the words' file; empty: standard input or output

    /// Reads CHANNEL and FILE from the words, connects, and requests the columns. Returns false
    /// after printing the error.
    /// `component`: "sampler" or "streamer"; a channel that is a number belongs to it.
    bool open(const StreamOptions& options, const char* component);
    /// Registers this process as a component, as LinuxCNC's programs do, so that `loadusr -Wn NAME`
    /// sees that it is ready.
    bool announce(const StreamOptions& options) const;
    /// Returns why a request for records was rejected: the stream is lost, or as the reply states.
    std::string problem(const nlohmann::json& reply) const;
};

/// Polling interval while the FIFO is empty, or full.
constexpr std::int64_t poll_ns = 2'000'000;

}  // namespace hal::tools
