// SPDX-License-Identifier: MIT
// An Ethernet segment of this machine alone: interfaces that are stations, and a switch between
// them.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace hal::bench {

/// Runs `work` in a thread that has a network namespace of its own, as have the threads and
/// programs it starts, and passes on what it throws. False: no namespace may be made here, and
/// nothing was run.
bool in_own_network(const std::function<void()>& work);

/// Interfaces `bench0`, `bench1`, … of this namespace, each a cable into one switch. Empty when
/// `ip` is missing or was denied.
std::vector<std::string> make_segment(int stations);

void sleep_until(std::int64_t monotonic_ns);
/// Asleep until shortly before, then looking at the clock, as the runtime's threads wait.
void wait_until(std::int64_t monotonic_ns, std::int64_t spin_ns);

/// Root mean square of the distances from the median, without the hundredth that is farthest off.
/// Reorders the samples.
double trimmed_rms(std::vector<double>& samples);

}  // namespace hal::bench
