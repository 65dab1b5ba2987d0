// SPDX-License-Identifier: MIT
#include "fieldbus/can_timing/recorded.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "link/timing.hpp"

namespace hal::can_timing {

namespace {

constexpr std::size_t fewest_for_a_grid = 5;

/// Sets period and jitter from the times of the frames, in order.
void measure(const std::vector<std::int64_t>& times, Recorded& to) {
    std::int64_t shortest = INT64_MAX;
    for (std::size_t i = 1; i < times.size(); ++i) {
        shortest = std::min(shortest, std::max<std::int64_t>(times[i] - times[i - 1], 1));
    }
    to.message.period = shortest;
    if (times.size() < fewest_for_a_grid) return;
    // the line through all frames: its slope is the period
    const double n = static_cast<double>(times.size());
    const double middle = (n - 1) / 2;
    double sum = 0;
    for (std::size_t i = 0; i < times.size(); ++i) {
        sum += (static_cast<double>(i) - middle) * static_cast<double>(times[i] - times[0]);
    }
    const double period = sum * 12 / (n * (n * n - 1));
    double earliest = INFINITY;
    double latest = -INFINITY;
    for (std::size_t i = 0; i < times.size(); ++i) {
        const double off =
            static_cast<double>(times[i] - times[0]) - static_cast<double>(i) * period;
        earliest = std::min(earliest, off);
        latest = std::max(latest, off);
    }
    if (!(latest - earliest <= period / 2)) return;
    to.periodic = true;
    to.message.period = std::llround(period);
    to.message.jitter = std::llround(latest - earliest);
}

}  // namespace

std::vector<Recorded> recorded(std::span<const can::Frame> frames) {
    struct Seen {
        Recorded what;
        std::vector<std::int64_t> times;
    };
    std::map<std::uint32_t, Seen> by_rank;
    for (const can::Frame& f : frames) {
        if (f.error) continue;
        Seen& seen = by_rank[can::arbitration_rank(f)];
        Message& m = seen.what.message;
        m.id = f.id;
        m.extended = f.extended;
        m.remote = f.remote;
        m.fd = m.fd || f.fd;
        m.bit_rate_switch = m.bit_rate_switch || f.bit_rate_switch;
        m.bytes = std::max(m.bytes, f.length);
        seen.times.push_back(f.time_ns);
    }
    std::vector<Recorded> all;
    for (auto& [rank, seen] : by_rank) {
        seen.what.frames = seen.times.size();
        if (seen.times.size() > 1) {
            measure(seen.times, seen.what);
        }
        all.push_back(seen.what);
    }
    return all;
}

}  // namespace hal::can_timing
