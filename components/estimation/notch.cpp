// SPDX-License-Identifier: MIT
#include <cmath>
#include <vector>

#include "estimation/sections.hpp"
#include "hal/component.hpp"

namespace {

using namespace hal::estimation;

struct Notch : hal::Component {
    explicit Notch(const hal_host* host)
        : Component(host), harmonics(*this, "harmonics", 1, "notches at so many multiples of the frequency", {.min = 1, .max = 16}) {
        sections_.resize(static_cast<std::size_t>(harmonics));
        coefficients_.resize(sections_.size());
    }

    hal::Argument           harmonics;
    hal::In<double>         in{*this, "in", "the input"};
    hal::Out<double>        out{*this, "out", "the input without the frequency", {.finite = true}};
    hal::In<bool>           enable{*this, "enable", "FALSE: out is in", {.initial = true}};
    hal::In<double>         frequency{*this, "frequency", "to take out; may follow a speed", {.initial = 50.0, .unit = "Hz"}};
    hal::In<double>         width{*this, "width", "between the two frequencies that are 3 dB down", {.initial = 5.0, .unit = "Hz"}};
    hal::In<double>         depth{*this, "depth", "what remains in the middle: 0 nothing, 1 all"};
    hal::Out<std::uint32_t> active{*this, "active", "notches at work: those below 0.45 of the thread's rate"};
    hal::Out<std::uint32_t> bad_inputs{*this, "bad-inputs", "inputs that were no number: out stays"};
    hal::Function           run{*this, "", &Notch::update, "filters"};

    void update(hal::Cycle cycle) noexcept {
        const double now = in, f = std::fabs(frequency * cycle.seconds()), w = width * cycle.seconds(), d = depth;
        if (f != f_ || w != w_ || d != d_) design(f, w, d);
        if (!std::isfinite(now)) {
            bad_inputs = bad_inputs + 1;
            return;
        }
        const std::size_t count = enable ? used_ : 0;
        double            y = now;
        for (std::size_t i = 0; i < count; ++i) {
            if (i >= running_) sections_[i].settle(coefficients_[i], y);
            y = sections_[i].step(coefficients_[i], y);
        }
        running_ = std::isfinite(y) ? count : 0;
        out = std::isfinite(y) ? y : now;
        active = static_cast<std::uint32_t>(count);
    }

private:
    void design(double f, double w, double d) noexcept {
        f_ = f, w_ = w, d_ = d;
        used_ = 0;
        if (!(w > 0.0 && w < 1.0 && d >= 0.0 && d <= 1.0 && f > 1e-9)) return;
        while (used_ < sections_.size() && f * static_cast<double>(used_ + 1) < 0.45) {
            const double centre = f * static_cast<double>(used_ + 1);
            coefficients_[used_++] = section(Shape::notch, centre, centre / w, d);
        }
    }

    std::vector<Section>      sections_;
    std::vector<Coefficients> coefficients_;
    double                    f_ = -1.0, w_ = 0.0, d_ = 0.0;
    std::size_t               used_ = 0, running_ = 0;
};

}  // namespace

HAL_COMPONENT(Notch, "notch", "Takes a frequency and its multiples out of a signal; the frequency may move", R"(
A notch of `width` Hz about `frequency` and, with `harmonics`, about its multiples: mains hum in a force sensor, the teeth of a gear, a spindle's
imbalance. Link `frequency` to the speed (in turns per second) and the notches follow it from one cycle to the next. A notch above 0.45 of the
thread's rate, or without a sensible width and depth, is left out; `active` says how many work.

    loadrt notch names=no-hum harmonics=3
    addf no-hum servo
    setp no-hum.frequency 50
    net force-raw => no-hum.in
    net force     <= no-hum.out
)")
