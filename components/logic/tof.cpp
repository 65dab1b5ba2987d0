// SPDX-License-Identifier: MIT
#include "iec_time.hpp"

namespace {

struct Tof : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, "in", "the input"};
    hal::Out<bool> q{*this, "q", "TRUE with in, and until in has been FALSE for pt"};
    hal::Out<double> et{
        *this, "et", "time for which in has been FALSE, until q is FALSE", {.unit = "s"}};
    iec::PresetTime pt{*this, "pt", "delay", {.unit = "s"}};
    hal::Function run{*this, "", hal::step<&Tof::update>, "measures the time"};

    void update(hal::Cycle cycle) noexcept {
        pt.correct_sign();
        if (in) {
            q = true;
            et = 0.0;
        } else if (!(et < pt)) {
            q = false;
        } else {
            et = et + cycle.seconds();
        }
    }
};

}  // namespace

HAL_COMPONENT(Tof, "tof", "IEC timer: off-delay", R"(
`q` becomes TRUE with `in`, and FALSE after `in` has been FALSE for `pt` seconds. `et` includes the
cycle of the falling edge; `q` follows in the cycle after the one in which `et` reaches `pt`. `et`
also counts from the start until `in` is TRUE for the first time. A negative `pt` is set to 0. A NaN
`pt` counts as 0 (LinuxCNC: `q` remains TRUE).

    loadrt tof names=run-on
    addf run-on servo
    setp run-on.pt 60
    net spindle-on  => run-on.in
    net spindle-fan <= run-on.q
)")
