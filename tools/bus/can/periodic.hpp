// SPDX-License-Identifier: MIT
// What `hal can generate` and `hal can produce` have in common.
#pragma once

#include <cstdint>
#include <functional>

#include "bus/can/bus.hpp"
#include "bus/can/periodic_options.hpp"

namespace hal::tools {

/// Sends one frame every `interval_ns`, until the time or the count of the options is reached or a signal
/// arrives; `next` makes the frame from its number. Returns the exit code.
int send_periodically(Bus& bus, const PeriodicOptions& options, std::int64_t interval_ns,
                      const std::function<can::Frame(std::uint64_t)>& next);

}  // namespace hal::tools
