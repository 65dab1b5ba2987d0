// SPDX-License-Identifier: MIT
#include <atomic>

#include "hal/component.hpp"
#include "hal/queue.hpp"

namespace {

/// What the fast function has seen up to one of its cycles, in counts since the start.
struct Seen {
    std::int64_t raw = 0;
    std::int64_t now_ns = 0;      // the fast function's own time: the sum of its periods
    std::int64_t edge_ns = 0;     // when the newest count was
    std::uint32_t indexes = 0;    // index marks that counted, so far
    std::int64_t index_raw = 0;
};

struct Counter : hal::Component {
    using Component::Component;

    hal::Function count{*this, "update-counters", hal::step<&Counter::update_counters>, "samples the inputs and counts; in the fastest thread",
                        {.shared = true}};
    hal::In<bool> phase_a{*this, count, "phase-A", "a rising edge counts"};
    hal::In<bool> phase_z{*this, count, "phase-Z", "index pulse"};
    hal::Out<std::int32_t> raw_counts{*this, count, "rawcounts", "counts since the start; knows nothing of reset and index"};

    hal::Function capture{*this, "capture-position", hal::step<&Counter::capture_position>, "scales and publishes; in the servo thread",
                          {.shared = true}};
    hal::Io<bool> index_enable{*this, capture, "index-enable", "TRUE: at the next rising edge of phase-Z counts become 0, and this FALSE"};
    hal::In<bool> reset{*this, capture, "reset", "while TRUE, counts and position are 0"};
    hal::Io<double> position_scale{*this, capture, "position-scale", "counts per position unit", {.initial = 1.0}};
    hal::Out<std::int32_t> counts{*this, capture, "counts", "position in counts"};
    hal::Out<double> position{*this, capture, "position", "counts / position-scale"};
    hal::Out<double> velocity{*this, capture, "velocity", "speed in position units per second"};

    void update_counters(hal::Cycle cycle) noexcept {
        seen_.now_ns += cycle.period_ns();
        const bool a = phase_a, z = phase_z;
        if (!started_) {  // the first sample says where the inputs stand
            started_ = true;
            a_ = a, z_ = z;
        }
        if (a && !a_) {
            ++seen_.raw;
            seen_.edge_ns = seen_.now_ns;
        }
        if (z && !z_ && armed_.exchange(false, std::memory_order_relaxed)) {
            ++seen_.indexes;
            seen_.index_raw = seen_.raw;
        }
        a_ = a, z_ = z;
        raw_counts = static_cast<std::int32_t>(seen_.raw);
        handed_.put(seen_);
    }

    void capture_position(hal::Cycle) noexcept {
        const Seen& now = handed_.get();
        if (std::fabs(position_scale) < 1e-20 || !std::isfinite(position_scale)) position_scale = 1.0;
        const double scale = position_scale;
        if (index_enable && waiting_ && now.indexes != indexes_) {
            zero_ = now.index_raw;
            index_enable = false;
        }
        indexes_ = now.indexes;
        if (index_enable != waiting_) {
            waiting_ = !waiting_;
            armed_.store(waiting_, std::memory_order_relaxed);
        }
        if (reset) zero_ = now.raw;
        counts = static_cast<std::int32_t>(now.raw - zero_);
        position = static_cast<double>(now.raw - zero_) / scale;
        velocity = speed(now) / scale;
    }

private:
    /// Counts per second between the newest edges. While none comes, the speed is at most one count in the time since.
    double speed(const Seen& now) noexcept {
        if (now.raw != last_raw_) {
            const double time = static_cast<double>(now.edge_ns - last_edge_ns_) / 1e9;
            speed_ = moving_ && time > 0.0 ? static_cast<double>(now.raw - last_raw_) / time : 0.0;
            last_raw_ = now.raw;
            last_edge_ns_ = now.edge_ns;
            moving_ = true;
        } else if (moving_) {
            const double time = static_cast<double>(now.now_ns - last_edge_ns_) / 1e9;
            if (time > 0.0) speed_ = std::min(speed_, 1.0 / time);
            if (speed_ < 0.1) speed_ = 0.0, moving_ = false;  // it has stopped: the next edge says nothing of speed
        }
        return speed_;
    }

    // The fast function's, but for armed_, which the slow one sets and the fast one clears.
    Seen seen_;
    bool started_ = false, a_ = false, z_ = false;
    std::atomic<bool> armed_{false};
    hal::Mailbox<Seen> handed_;  // from the fast function to the slow one

    // The slow function's.
    std::int64_t zero_ = 0, last_raw_ = 0, last_edge_ns_ = 0;
    std::uint32_t indexes_ = 0;
    double speed_ = 0.0;
    bool waiting_ = false, moving_ = false;
};

}  // namespace

HAL_COMPONENT(Counter, "counter", "Counts pulses of a sensor that turns one way", R"(
For a spindle with a pulse per slot and an index per turn. `encoder` with `counter-mode` does the same and more; this
one exists for netlists that use it. The first sample is where counting starts, no edge. Below 0.1 counts per second `velocity` is 0.

    loadrt counter names=spindle
    addf counter.update-counters base
    addf counter.capture-position servo
    setp spindle.position-scale 100
    net spindle-slots => spindle.phase-A
    net spindle-index => spindle.phase-Z
    net spindle-turns <= spindle.position
    net spindle-speed <= spindle.velocity
)")
