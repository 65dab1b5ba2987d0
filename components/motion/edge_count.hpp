// SPDX-License-Identifier: MIT
// What encoder and counter share: counting in a fast thread, with index and speed in the servo
// thread.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>

#include "hal/component.hpp"
#include "hal/last_valid.hpp"
#include "hal/queue.hpp"

namespace edge_count {

/// What the fast function has counted at the end of one of its cycles. Counts are since the start.
struct Sample {
    std::int64_t raw = 0;
    // time of the fast function: the sum of its periods
    std::int64_t now_ns = 0;
    std::int64_t tick_ns = 0;                    // the last of these periods
    // exact position of the newest edge: between count edge - 1 and count edge
    std::int64_t edge = 0;
    std::int64_t edge_ns = 0;                    // time of the newest edge
    std::uint32_t indexes = 0;
    std::uint32_t latches = 0;      // accepted index pulses and latch edges so far
    std::int64_t index_raw = 0;
    std::int64_t latch_raw = 0;   // raw at the newest of each
};

/// The fast thread's side calls begin, move, index, latch and publish; the servo thread's side
/// calls capture and the others.
class Count {
public:
    /// Starts a cycle of the fast function. [realtime] fast
    void begin(std::int64_t period_ns) noexcept {
        sample_.tick_ns = period_ns;
        sample_.now_ns += period_ns;
    }
    void move(std::int64_t counts) noexcept {
        if (counts == 0) return;
        sample_.raw += counts;
        sample_.edge = counts > 0 ? sample_.raw : sample_.raw + 1;
        sample_.edge_ns = sample_.now_ns;
    }
    /// Takes the index pulse if the servo thread waits for one. [realtime] fast
    void index() noexcept {
        if (!armed_.exchange(false, std::memory_order_relaxed)) return;
        ++sample_.indexes;
        sample_.index_raw = sample_.raw;
    }
    void latch() noexcept {
        ++sample_.latches;
        sample_.latch_raw = sample_.raw;
    }
    /// Hands the cycle's sample to the servo thread. [realtime] fast
    const Sample& publish() noexcept {
        handed_.put(sample_);
        return sample_;
    }

    /// Returns the newest sample after moving the zero to the index or, while `reset`, to the
    /// current count. Clears `index_enable` at the index. [realtime] servo
    const Sample& capture(hal::Io<bool>& index_enable, bool reset) noexcept {
        const Sample& now = handed_.get();
        if (index_enable && waiting_ && now.indexes != indexes_) {
            zero_ = now.index_raw;
            index_enable = false;
        }
        indexes_ = now.indexes;
        if (index_enable != waiting_) {
            waiting_ = !waiting_;
            armed_.store(waiting_, std::memory_order_relaxed);
        }
        if (reset) {
            zero_ = now.raw;
        }
        return now;
    }
    std::int64_t zero() const noexcept { return zero_; }

    /// Returns the speed in counts per second: the distance between the newest edges of two cycles,
    /// each at its exact position, divided by the time between them. A shaft that trembles across
    /// one edge has speed 0, and so has one after its first edge. Without an edge the speed is
    /// limited to what an edge in the next cycle of the fast function would give. [realtime] servo
    double speed(const Sample& now) noexcept {
        if (now.edge_ns != edge_ns_) {
            if (edge_ns_ > 0) {
                speed_ = static_cast<double>(now.edge - edge_) * 1e9 /
                         static_cast<double>(now.edge_ns - edge_ns_);
            }
            edge_ = now.edge;
            edge_ns_ = now.edge_ns;
        }
        if (now.now_ns > edge_ns_) {
            const double bound = 1e9 / static_cast<double>(now.now_ns + now.tick_ns - edge_ns_);
            speed_ = std::clamp(speed_, -bound, bound);
        }
        return speed_;
    }
    /// Returns the position in counts at `speed` between two edges. [realtime] servo
    double interpolate(const Sample& now) const noexcept {
        const double travelled = speed_ * 1e-9 * static_cast<double>(now.now_ns - edge_ns_);
        const double position = static_cast<double>(now.edge) + travelled;

        const double cell = static_cast<double>(now.raw);
        return std::clamp(position, cell, cell + 1.0) - static_cast<double>(zero_);
    }

    static constexpr bool retainable = true;

private:
    Sample sample_;  // fast thread
    hal::Mailbox<Sample> handed_;  // written by the fast thread, read by the servo thread
    // set by the servo thread while index-enable waits, cleared by the fast thread at the index
    std::atomic<bool> armed_{false};
    // servo thread
    bool waiting_ = false;
    std::uint32_t indexes_ = 0;
    std::int64_t zero_ = 0;
    std::int64_t edge_ = 0;
    std::int64_t edge_ns_ = 0;
    double speed_ = 0.0;
};

/// The counts per unit of position. 0 is set to 1; while the pin is NaN or infinite, its last valid
/// value applies: another one would move the position.
class Scale {
public:
    Scale(hal::Component& component, hal::Io<double>& pin)
        : pin_(pin), valid_(component, "position-scale", hal::finite_value, 1.0) {}
    /// Returns the scale that applies. [realtime]
    double get() noexcept {
        if (std::fabs(pin_) < 1e-20) {
            pin_ = 1.0;
        }
        return valid_.follow(pin_);
    }

private:
    hal::Io<double>& pin_;
    hal::LastValid valid_;
};

}  // namespace edge_count
