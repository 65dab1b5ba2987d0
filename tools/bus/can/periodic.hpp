// SPDX-License-Identifier: MIT
// What the commands that send frames periodically have in common.
#pragma once

#include <cstdint>
#include <functional>

#include "bus/can/bus.hpp"
#include "bus/can/periodic_options.hpp"

namespace hal::tools {

struct Repeated {
    std::uint64_t rounds = 0;
    double seconds = 0.0;
};
/// Calls `send(n)` with n = 0, 1, … every `interval_ns`, which sends the frames of one round, until
/// the time or the count of the options is reached or a signal arrives.
Repeated repeat(Bus& bus, const PeriodicOptions& options, std::int64_t interval_ns,
                const std::function<void(std::uint64_t)>& send);

/// Waits until all frames have left, and prints how many there were and how long their rounds took.
/// Returns the exit code.
int finish_rounds(Bus& bus, const Options& options, std::uint64_t frames, const Repeated& rounds);

/// Sends one frame every `interval_ns`; `next` makes the frame from its number. Returns the exit
/// code.
int send_periodically(Bus& bus, const PeriodicOptions& options, std::int64_t interval_ns,
                      const std::function<can::Frame(std::uint64_t)>& next);

}  // namespace hal::tools
