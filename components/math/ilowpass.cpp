// SPDX-License-Identifier: MIT
#include "conv.hpp"

namespace {

struct Ilowpass : hal::Component {
    using Component::Component;
    hal::In<std::int32_t>  in{*this, "in", "counts, for example of a hand wheel"};
    hal::Out<std::int32_t> out{*this, "out", "in * scale, smoothed; goes round at the ends of the type"};
    hal::Param<double>     scale{*this, "scale", "steps of out per count", {.initial = 1024.0}};
    hal::Param<double>     gain{*this, "gain", "share of the way to the input in each cycle, 0 to 1", {.initial = 0.5}};
    hal::Function          run{*this, "", hal::step<&Ilowpass::update>, "smooths"};

    void update(hal::Cycle) noexcept {
        const double next = state_ + (in * scale.get() - state_) * gain;
        if (std::isfinite(next)) state_ = next;
        out = conv::convert<std::int32_t>(std::floor(state_ + 0.5), false);
    }

private:
    double state_ = 0.0;
};

}  // namespace

HAL_COMPONENT(Ilowpass, "ilowpass", "Low-pass filter for counts", R"(
Makes the steps of a hand wheel into smooth motion: `out` goes to `in * scale` by the share `gain` per cycle and gets
all the way there. Divide the jog scale of the axis by `scale`. `out` goes round at the ends of its type, as counters do; what follows
must take differences. A cycle whose result is not a number is left out; above a gain of 2 the filter is unstable.

    loadrt ilowpass names=wheel-smooth
    addf wheel-smooth servo
    setp wheel-smooth.gain 0.01
    net wheel-counts => wheel-smooth.in
    net x-jog-counts <= wheel-smooth.out
)")
