// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/interruption.hpp"
#include "hal/retained.hpp"

namespace {

struct Ddt : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "the input"};
    hal::Out<double> out{*this, "out", "change of in per second"};
    hal::Function run{*this, "", hal::step<&Ddt::update>, "computes out"};

    void update(hal::Cycle cycle) noexcept {
        const double value = in;
        if (interruption_.accept()) {
            before_ = value;
        }
        out = std::isfinite(before_) ? (value - before_) / cycle.seconds() : 0.0;
        before_ = value;
    }

private:
    double before_ = 0.0;
    hal::Interruption interruption_{*this};
    hal::Retained retained_{*this, {{"before", before_}, {"interruption", interruption_}}};
};

}  // namespace

HAL_COMPONENT(Ddt, "ddt", "Derivative of a value", R"(
`out = (in - in of the previous cycle) / period`. Before the first cycle the input counts as 0;
after a NaN input, and after a stop of the thread, `out` is 0 for a cycle (LinuxCNC: NaN, and the
change during the stop as if it had happened in one period). A quantised input gives a noisy
derivative: filter it with `lowpass`.

    loadrt ddt names=velocity
    addf velocity servo
    net position => velocity.in
    net velocity <= velocity.out
)")
