// SPDX-License-Identifier: MIT
// The round trip of frames on an EtherCAT segment.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace hal::tools {

struct RoundTrip {
    std::uint64_t frames = 0;  ///< sent
    std::uint64_t lost = 0;    ///< not back within 20 ms
    double p50_ns = 0;
    double p99_ns = 0;
    double max_ns = 0;
    std::string problem{};  ///< why nothing was measured, or empty

    explicit operator bool() const { return problem.empty(); }
};

/// Sends a broadcast read of register 0 (BRD, ETG.1000.4 clause 5.4) each millisecond for
/// `duration_ns`, at the highest permitted priority, and measures until it is back. It changes
/// nothing in the slaves. Ends early when `stopped` returns true. [setup]
RoundTrip measure_round_trip(const std::string& interface, std::int64_t duration_ns,
                             const std::function<bool()>& stopped);

/// Returns true when a program has a socket for EtherCAT frames on this interface. [setup]
bool has_ethercat_user(const std::string& interface);

}  // namespace hal::tools
