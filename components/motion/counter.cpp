// SPDX-License-Identifier: MIT
#include "edge_count.hpp"
#include "hal/retained.hpp"

namespace {

struct Counter : hal::Component {
    using Component::Component;

    hal::Function count{*this,
                        "update-counters",
                        hal::step<&Counter::update_counters>,
                        "samples the inputs and counts; belongs in the fastest thread",
                        {.shared = true}};
    hal::In<bool> phase_a{*this, count, "phase-A", "pulse input; rising edges are counted"};
    hal::In<bool> phase_z{*this, count, "phase-Z", "index pulse"};
    hal::Out<std::int32_t> raw_counts{*this, count, "rawcounts",
                                      "counts since the start, unaffected by reset and index"};

    hal::Function capture{*this,
                          "capture-position",
                          hal::step<&Counter::capture_position>,
                          "scales the counts; belongs in the servo thread",
                          {.shared = true}};
    hal::Io<bool> index_enable{
        *this, capture, "index-enable",
        "TRUE: the next rising edge of phase-Z sets counts to 0 and this pin to FALSE"};
    hal::In<bool> reset{*this, capture, "reset", "TRUE holds counts and position at 0"};
    hal::Io<double> position_scale{
        *this, capture, "position-scale", "counts per position unit", {.initial = 1.0}};
    hal::Out<std::int32_t> counts{*this, capture, "counts", "position in counts"};
    hal::Out<double> position{*this, capture, "position", "counts / position-scale"};
    hal::Out<double> velocity{*this, capture, "velocity", "speed in position units per second"};

    void update_counters(hal::Cycle cycle) noexcept {
        count_.begin(cycle.period_ns());
        const bool a = phase_a;
        const bool z = phase_z;
        if (started_) {  // the first sample has no edges
            if (a && !a_) {
                count_.move(1);
            }
            if (z && !z_) {
                count_.index();
            }
        }
        started_ = true;
        a_ = a;
        z_ = z;
        raw_counts = static_cast<std::int32_t>(count_.publish().raw);
    }

    void capture_position(hal::Cycle) noexcept {
        const auto& now = count_.capture(index_enable, reset);
        const double scale = scale_.get();
        const double speed = count_.speed(now);
        counts = static_cast<std::int32_t>(now.raw - count_.zero());
        position = static_cast<double>(now.raw - count_.zero()) / scale;
        velocity = speed < 0.1 ? 0.0 : speed / scale;
    }

private:
    edge_count::Count count_;
    edge_count::Scale scale_{*this, position_scale};
    bool started_ = false;
    bool a_ = false;
    bool z_ = false;  // update-counters
    hal::Retained retained_{*this,
                            {{"count", count_}, {"started", started_}, {"a", a_}, {"z", z_}}};
};

}  // namespace

HAL_COMPONENT(Counter, "counter",
              "Counts pulses of a sensor on a shaft that turns in one direction", R"(
For a spindle with slots and an index pulse per revolution. `encoder` with `counter-mode` has the
same functions and more; `counter` is for netlists that already use it. The first sample has no edge
(LinuxCNC: a `phase-A` that is TRUE from the start counts). Below 0.1 counts per second `velocity`
is 0. While `position-scale` is NaN or infinite, its last valid value applies, and a fault names it;
0 is set to 1.

    loadrt counter names=spindle
    addf counter.update-counters base
    addf counter.capture-position servo
    setp spindle.position-scale 100
    net spindle-slots => spindle.phase-A
    net spindle-index => spindle.phase-Z
    net spindle-turns <= spindle.position
    net spindle-speed <= spindle.velocity
)")
