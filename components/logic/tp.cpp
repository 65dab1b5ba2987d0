// SPDX-License-Identifier: MIT
#include "iec_time.hpp"

namespace {

struct Tp : hal::Component {
    using Component::Component;
    hal::In<bool>      in{*this, "in", "a rising edge starts the pulse"};
    hal::Out<bool>     q{*this, "q", "TRUE during the pulse"};
    hal::Out<double>   et{*this, "et", "time since the start of the pulse, up to pt", {.unit = "s"}};
    hal::Param<double> pt{*this, "pt", "duration of the pulse", {.unit = "s"}};
    hal::Function      run{*this, "", hal::step<&Tp::update>, "measures the time"};

    void update(hal::Cycle cycle) noexcept {
        if (q) elapsed_.advance(cycle.period_ns());
        else if (in && !was_in_) started_ = true, elapsed_.restart();
        was_in_ = in;
        q = started_ && !elapsed_.reached(pt);
        if (!q && !in) started_ = false, elapsed_.restart();
        et = started_ ? elapsed_.limited(pt) : 0.0;
    }

private:
    iec::Elapsed elapsed_;
    bool was_in_ = false, started_ = false;
};

}  // namespace

HAL_COMPONENT(Tp, "tp", "IEC timer: pulse", R"(
A rising edge of `in` sets `q` for `pt` seconds, regardless of further changes of `in`. After the pulse `et` remains at `pt` until
`in` is FALSE.

    loadrt tp names=lubricate
    addf lubricate servo
    setp lubricate.pt 2.5
    net part-done => lubricate.in
    net lube-pump <= lubricate.q
)")
