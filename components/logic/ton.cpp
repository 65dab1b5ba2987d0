// SPDX-License-Identifier: MIT
#include "iec_time.hpp"

namespace {

struct Ton : hal::Component {
    using Component::Component;
    hal::In<bool>      in{*this, "in", "the input"};
    hal::Out<bool>     q{*this, "q", "TRUE after in has been TRUE for pt"};
    hal::Out<double>   et{*this, "et", "time since the rising edge, up to pt", {.unit = "s"}};
    hal::Param<double> pt{*this, "pt", "delay", {.unit = "s"}};
    hal::Function      run{*this, "", hal::step<&Ton::update>, "measures the time"};

    void update(hal::Cycle cycle) noexcept {
        if (in && was_in_) elapsed_.advance(cycle.period_ns());
        else elapsed_.restart();
        was_in_ = in;
        q = in && elapsed_.reached(pt);
        et = elapsed_.limited(pt);
    }

private:
    iec::Elapsed elapsed_;
    bool was_in_ = false;
};

}  // namespace

HAL_COMPONENT(Ton, "ton", "IEC timer: on-delay", R"(
`q` becomes TRUE after `in` has been TRUE for `pt` seconds, and FALSE with `in`. The time starts in the cycle of the rising edge, in which
`et` is 0; the time of `timedelay` includes that cycle, so it switches one cycle earlier.

    loadrt ton names=spin-up
    addf spin-up servo
    setp spin-up.pt 1.5
    net spindle-on    => spin-up.in
    net spindle-ready <= spin-up.q
)")
