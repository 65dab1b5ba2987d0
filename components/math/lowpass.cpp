// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Lowpass : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "the input"};
    hal::Out<double> out{*this, "out", "filtered input"};
    hal::In<bool> load{*this, "load", "TRUE copies in to out"};
    hal::In<double> gain{*this, "gain", "weight of the new value, 0..1"};
    hal::Function run{*this, "", hal::step<&Lowpass::update>, "filters"};

    void update(hal::Cycle) noexcept {
        const double value = load ? in.get() : state_ + (in - state_) * gain;
        if (std::isfinite(value)) {
            state_ = value;
        }
        out = state_;
    }

private:
    double state_ = 0.0;
    hal::Retained retained_{*this, {{"state", state_}}};
};

}  // namespace

HAL_COMPONENT(Lowpass, "lowpass", "First-order low-pass filter", R"(
`out = out + (in - out) * gain`. For a corner frequency f in Hz and a period T in s:
`gain = 1 - exp(-2 pi f T)`. The gain is 0 until it is set, so the output does not change; above 2
the filter is unstable. NaN inputs are ignored.

    # 10 Hz in a 1 kHz thread
    loadrt lowpass names=load-smooth
    addf load-smooth servo
    setp load-smooth.gain 0.0609
    net spindle-load => load-smooth.in
    net load-meter   <= load-smooth.out
)")
