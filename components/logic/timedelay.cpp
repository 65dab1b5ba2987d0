// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Timedelay : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, "in", "the input"};
    hal::Out<bool> out{*this, "out", "the input, delayed"};
    hal::In<double> on_delay{*this,
                             "on-delay",
                             "time for which in must be TRUE before out becomes TRUE",
                             {.initial = 0.5, .unit = "s"}};
    hal::In<double> off_delay{*this,
                              "off-delay",
                              "time for which in must be FALSE before out becomes FALSE",
                              {.initial = 0.5, .unit = "s"}};
    hal::Out<double> elapsed{
        *this,
        "elapsed",
        "time for which in has differed from out; afterwards it keeps its value",
        {.unit = "s"}};
    hal::Function run{*this, "", hal::step<&Timedelay::update>, "measures the time"};

    void update(hal::Cycle cycle) noexcept {
        const bool now = in;
        if (now == out) {
            waited_s_ = 0.0;
            return;
        }
        waited_s_ += cycle.seconds();
        elapsed = waited_s_;
        if (waited_s_ < (now ? on_delay : off_delay)) return;
        out = now;
        waited_s_ = 0.0;  // a change back in the next cycle starts its own delay
    }

private:
    double waited_s_ = 0.0;  // time for which in has differed from out
    hal::Retained retained_{*this, {{"waited-s", waited_s_}}};
};

}  // namespace

HAL_COMPONENT(Timedelay, "timedelay", "Time-delay relay", R"(
`out` becomes TRUE when `in` has been TRUE for `on-delay` seconds without interruption, and FALSE
when it has been FALSE for `off-delay`. The time includes the cycle in which `in` changes, so `out`
follows one cycle earlier than `q` of `ton` with the same time. `elapsed` keeps its last value while
`in` and `out` are equal. A NaN delay counts as 0 (LinuxCNC: `out` never changes).

    loadrt timedelay names=pressure-ok
    addf pressure-ok servo
    setp pressure-ok.on-delay 2
    setp pressure-ok.off-delay 0.1
    net pressure-switch => pressure-ok.in
    net air-ok          <= pressure-ok.out
)")
