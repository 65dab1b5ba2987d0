// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Ddt : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "the input"};
    hal::Out<double> out{*this, "out", "change of in per second"};
    hal::Function run{*this, "", hal::step<&Ddt::update>, "computes out"};

    void update(hal::Cycle cycle) noexcept {
        const double value = in;
        out = std::isfinite(before_) ? (value - before_) / cycle.seconds() : 0.0;
        before_ = value;
    }

private:
    double before_ = 0.0;
    hal::Retained retained_{*this, {{"before", before_}}};
};

}  // namespace

HAL_COMPONENT(Ddt, "ddt", "Derivative of a value", R"(
`out = (in - in of the previous cycle) / period`. Before the first cycle the input counts as 0;
after a NaN input `out` is 0 for a cycle (LinuxCNC: NaN). A quantised input gives a noisy
derivative: filter it with `lowpass`.

    loadrt ddt names=velocity
    addf velocity servo
    net position => velocity.in
    net velocity <= velocity.out
)")
