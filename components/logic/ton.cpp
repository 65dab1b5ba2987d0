// SPDX-License-Identifier: MIT
#include "iec_time.hpp"

namespace {

struct Ton : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, "in", "the input"};
    hal::Out<bool> q{*this, "q", "TRUE after in has been TRUE for pt"};
    hal::Out<double> et{
        *this, "et", "time for which in has been TRUE, until q is TRUE", {.unit = "s"}};
    iec::PresetTime pt{*this, "pt", "delay", {.unit = "s"}};
    hal::Function run{*this, "", hal::step<&Ton::update>, "measures the time"};

    void update(hal::Cycle cycle) noexcept {
        pt.correct_sign();
        if (!in) {
            q = false;
            et = 0.0;
        } else if (!(et < pt)) {
            q = true;
        } else {
            et = et + cycle.seconds();
        }
    }
};

}  // namespace

HAL_COMPONENT(Ton, "ton", "IEC timer: on-delay", R"(
`q` becomes TRUE after `in` has been TRUE for `pt` seconds, and FALSE with `in`. `et` includes the
cycle of the rising edge; `q` follows in the cycle after the one in which `et` reaches `pt`
(`timedelay` switches in that cycle). A negative `pt` is set to 0. A NaN `pt` counts as 0 (LinuxCNC:
`q` remains FALSE).

    loadrt ton names=spin-up
    addf spin-up servo
    setp spin-up.pt 1.5
    net spindle-on    => spin-up.in
    net spindle-ready <= spin-up.q
)")
