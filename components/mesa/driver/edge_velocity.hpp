// SPDX-License-Identifier: MIT
// Velocity of an encoder from the times of its edges.
//
// Each cycle has the count, the time of the newest edge and the time of the reading, both in ticks of
// a counter of 16 bits. With new edges the velocity is their number by the time from the last edge
// known before to the newest one. Without, it is at most one count by the time since the newest edge,
// and 0 after the timeout.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace hal::mesa {

class EdgeVelocity {
public:
    struct Reading {
        std::int64_t counts = 0;  ///< since the last reading
        std::uint16_t edge_ticks = 0;
        std::uint16_t now_ticks = 0;
    };

    /// Begins at a reading, with velocity 0: at a start, and after a gap in which the ticks may have
    /// wrapped. [realtime]
    void restart(std::uint16_t now_ticks) noexcept {
        last_ticks_ = now_ticks;
        velocity_ = 0.0;
        direction_ = 0.0;
        age_s_ = never;
    }
    /// Returns the velocity in counts/s. [realtime]
    double update(const Reading& reading, double ticks_hz, double timeout_s) noexcept {
        const double passed_s = ticks(reading.now_ticks, last_ticks_) / ticks_hz;
        if (reading.counts != 0) {
            const double to_edge_s = ticks(reading.edge_ticks, last_ticks_) / ticks_hz;
            measure(static_cast<double>(reading.counts), age_s_ + to_edge_s, passed_s);
            age_s_ = ticks(reading.now_ticks, reading.edge_ticks) / ticks_hz;
        } else {
            age_s_ = std::min(age_s_ + passed_s, never);
            const double limit = 1.0 / std::max(age_s_, 1e-9);
            velocity_ = std::clamp(velocity_, -limit, limit);
            if (age_s_ > timeout_s) {
                velocity_ = 0.0;
            }
        }
        last_ticks_ = reading.now_ticks;
        return velocity_;
    }
    /// Returns the counts passed since the newest edge at the present velocity, -1..1. [realtime]
    double interpolated() const noexcept {
        return std::clamp(velocity_ * std::min(age_s_, 1.0), -1.0, 1.0);
    }
    double velocity() const noexcept { return velocity_; }

private:
    static constexpr double never = 1e6;  // s

    static double ticks(std::uint16_t to, std::uint16_t from) noexcept {
        return static_cast<std::uint16_t>(to - from);
    }
    void measure(double counts, double over_s, double passed_s) noexcept {
        const double direction = counts > 0.0 ? 1.0 : -1.0;
        const bool is_first = age_s_ >= never || direction != direction_;
        direction_ = direction;
        if (is_first && std::abs(counts) == 1.0) {
            // one edge does not determine the velocity after a standstill or in a new direction
            velocity_ = 0.0;
            return;
        }
        const double known_s = age_s_ >= never ? passed_s : over_s;
        velocity_ = counts / std::max(known_s, 1e-9);
    }

    std::uint16_t last_ticks_ = 0;
    double age_s_ = never;  // since the newest edge, at the last reading
    double velocity_ = 0.0;
    double direction_ = 0.0;  // of the newest edges
};

}  // namespace hal::mesa
