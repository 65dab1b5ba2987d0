// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Scale : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "the input"};
    hal::In<double> gain{*this, "gain", "factor of in"};
    hal::In<double> offset{*this, "offset", "added after the gain"};
    hal::Out<double> out{*this, "out", "in * gain + offset"};
    hal::Function run{*this, "", hal::step<&Scale::update>, "computes out"};

    void update(hal::Cycle) noexcept { out = in * gain + offset; }
};

}  // namespace

HAL_COMPONENT(Scale, "scale", "Applies a gain and an offset", R"(
`out = in * gain + offset`. The gain is 0 until it is set.

    # 0 to 10 V is -40 to 160 degrees
    loadrt scale names=temperature
    addf temperature servo
    setp temperature.gain 20
    setp temperature.offset -40
    net sensor-volts => temperature.in
    net temperature  <= temperature.out
)")
