// SPDX-License-Identifier: MIT
#include <numbers>

#include "hal/component.hpp"
#include "hal/corrected.hpp"
#include "hal/retained.hpp"

namespace {

struct Siggen : hal::Component {
    using Component::Component;
    hal::Out<double> square{*this, "square",
                            "square wave: positive while triangle and cosine rise"};
    hal::Out<double> sine{*this, "sine", "sine wave: lags cosine by 90 degrees"};
    hal::Out<double> cosine{*this, "cosine", "cosine wave: leads sine by 90 degrees"};
    hal::Out<double> triangle{*this, "triangle",
                              "triangle wave: peaks coincide with those of cosine"};
    hal::Out<double> sawtooth{*this, "sawtooth",
                              "sawtooth wave: rises, and drops at the positive peak of cosine"};
    hal::Out<bool> clock{*this, "clock", "TRUE while square is at its upper level"};
    hal::CorrectedIn<double> frequency{
        *this,
        "frequency",
        "periods of the wave per second, at most half the rate of the thread",
        {.initial = 1.0, .unit = "Hz"}};
    hal::In<double> amplitude{
        *this, "amplitude", "peak deviation of the waves from offset", {.initial = 1.0}};
    hal::In<double> offset{*this, "offset", "added to all waves"};
    hal::In<bool> reset{*this, "reset", "TRUE holds the waves in the middle of the period"};
    hal::Function run{*this, "update", &Siggen::update, "computes the next sample"};

    void update(hal::Cycle cycle) noexcept {
        if (reset) {
            phase_ = 0.5;
        } else {
            advance(cycle.seconds());
        }
        const double angle = 2.0 * std::numbers::pi * phase_;
        const bool second_half = phase_ > 0.5;
        const double scale = amplitude;
        const double middle = offset;
        square = middle + (second_half ? scale : -scale);
        sine = middle + scale * (phase_ == 0.5 ? 0.0 : std::sin(angle));
        cosine = middle + scale * std::cos(angle);
        triangle = middle + scale * (second_half ? 4.0 * phase_ - 3.0 : 1.0 - 4.0 * phase_);
        sawtooth = middle + scale * (2.0 * phase_ - 1.0);
        clock = second_half;
    }

private:
    void advance(double period_s) noexcept {
        double step = frequency * period_s;
        if (step > max_step) {
            frequency.correct(max_step / period_s);
            step = max_step;
        }
        const double next = phase_ + step;
        const double wrapped = next - std::floor(next);
        if (std::isfinite(wrapped)) {
            phase_ = wrapped < 1.0 ? wrapped : 0.0;
        }
    }

    static constexpr double max_step = 0.5;  // periods per cycle: the Nyquist frequency
    double phase_ = 0.0;  // 0 to below 1; 0 is the positive peak of cosine
    hal::Retained retained_{*this, {{"phase", phase_}}};
};

}  // namespace

HAL_COMPONENT(Siggen, "siggen", "Signal generator: sine, cosine, triangle, square, sawtooth", R"(
With the phase p running from 0 to 1 in 1/frequency seconds:

    cosine   = offset + amplitude * cos(2 pi p)        sine = offset + amplitude * sin(2 pi p)
    triangle = falls for p < 0.5, then rises           sawtooth = offset + amplitude * (2 p - 1)
    square   = offset - amplitude for p <= 0.5, else offset + amplitude

p begins at 0, and each cycle adds frequency * period to it before the waves are computed. While
`reset` is TRUE p is 0.5: sine and sawtooth are at `offset`, the others at `offset - amplitude`. A
frequency above half the rate of the thread is limited to it; if the pin is unlinked, it shows the
limited frequency.

**Differences from LinuxCNC:** `sine` and `cosine` are exact (LinuxCNC computes with a pi that is
4.6e-8 too large). A negative frequency runs all waves backwards (LinuxCNC: `sawtooth` and
`triangle` leave their ranges); the frequencies below minus half the rate are not limited. A
frequency that is NaN holds the phase (LinuxCNC: all outputs remain NaN).

    loadrt siggen names=test-signal
    addf test-signal.update servo
    setp test-signal.frequency 0.5
    setp test-signal.amplitude 10
    net command <= test-signal.sine
)")
