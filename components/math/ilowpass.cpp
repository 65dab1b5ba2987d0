// SPDX-License-Identifier: MIT
#include "conv.hpp"
#include "hal/retained.hpp"

namespace {

struct Ilowpass : hal::Component {
    using Component::Component;
    hal::In<std::int32_t> in{*this, "in", "counts, for example of a handwheel"};
    hal::Out<std::int32_t> out{*this, "out",
                               "in * scale, smoothed; wraps around at the limits of the type"};
    hal::Param<double> scale{*this, "scale", "steps of out per count", {.initial = 1024.0}};
    hal::Param<double> gain{*this, "gain", "filter gain per cycle, 0..1", {.initial = 0.5}};
    hal::Function run{*this, "", hal::step<&Ilowpass::update>, "filters the counts"};

    void update(hal::Cycle) noexcept {
        const double next = state_ + (in - state_) * gain;
        if (std::isfinite(next)) {
            state_ = next;
        }
        const double rounded = std::floor(state_ * scale + 0.5);
        constexpr double past_s64 = 0x1p63;
        out = std::fabs(rounded) < past_s64 ? conv::convert<std::int32_t>(rounded, false) : 0;
    }

private:
    double state_ = 0.0;
    hal::Retained retained_{*this, {{"state", state_}}};
};

}  // namespace

HAL_COMPONENT(Ilowpass, "ilowpass", "Low-pass filter for counts", R"(
Turns the steps of a handwheel into smooth motion: each cycle, `out` moves by the fraction `gain` of
the remaining distance to `in * scale`, and it reaches it exactly. Divide the jog scale of the axis
by `scale`. `out` wraps around at the limits of its type, as counters do; use its differences.
Beyond the range of s64 it is 0. A cycle whose result is NaN is skipped; above a gain of 2 the
filter is unstable.

    loadrt ilowpass names=wheel-smooth
    addf wheel-smooth servo
    setp wheel-smooth.gain 0.01
    net wheel-counts => wheel-smooth.in
    net x-jog-counts <= wheel-smooth.out
)")
