// SPDX-License-Identifier: MIT
#include "iec_time.hpp"

namespace {

struct Tof : hal::Component {
    using Component::Component;
    hal::In<bool>      in{*this, "in", "the input"};
    hal::Out<bool>     q{*this, "q", "TRUE with in, and until in has been FALSE for pt"};
    hal::Out<double>   et{*this, "et", "time since the falling edge, up to pt", {.unit = "s"}};
    hal::Param<double> pt{*this, "pt", "delay", {.unit = "s"}};
    hal::Function      run{*this, "", hal::step<&Tof::update>, "measures the time"};

    void update(hal::Cycle cycle) noexcept {
        if (in) waiting_ = true, elapsed_.restart();
        else if (waiting_ && !was_in_) elapsed_.advance(cycle.period_ns());
        was_in_ = in;
        if (!in && elapsed_.reached(pt)) waiting_ = false;
        q = waiting_;
        et = elapsed_.limited(pt);
    }

private:
    iec::Elapsed elapsed_;
    bool was_in_ = false, waiting_ = false;
};

}  // namespace

HAL_COMPONENT(Tof, "tof", "IEC timer: off-delay", R"(
`q` becomes TRUE with `in`, and FALSE after `in` has been FALSE for `pt` seconds.

    loadrt tof names=run-on
    addf run-on servo
    setp run-on.pt 60
    net spindle-on  => run-on.in
    net spindle-fan <= run-on.q
)")
