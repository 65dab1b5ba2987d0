// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct Oneshot : hal::Component {
    using Component::Component;
    hal::In<bool> in{*this, "in",
                     "an edge starts the pulse; TRUE in the first cycle is a rising edge"};
    hal::In<bool> reset{*this, "reset",
                        "TRUE ends the pulse and prevents new ones; afterwards an input that is "
                        "TRUE is a rising edge"};
    hal::Out<bool> out{*this, "out", "TRUE during the pulse"};
    hal::Out<bool> out_not{*this, "out-not", "FALSE during the pulse"};
    hal::In<double> width{*this, "width", "duration of the pulse", {.unit = "s"}};
    hal::Out<double> time_left{*this, "time-left", "remaining time of the pulse", {.unit = "s"}};
    hal::Param<bool> retriggerable{
        *this, "retriggerable", "TRUE: an edge during the pulse restarts it", {.initial = true}};
    hal::Param<bool> rising{*this, "rising", "TRUE: rising edges start a pulse", {.initial = true}};
    hal::Param<bool> falling{*this, "falling", "TRUE: falling edges start a pulse"};
    hal::Function run{*this, "", hal::step<&Oneshot::update>, "turns edges into pulses"};

    void update(hal::Cycle cycle) noexcept {
        if (reset) {
            left_s_ = 0.0;
            was_in_ = false;
            out = false;
            out_not = true;
            return;
        }
        const bool now = in;
        const bool edge = now != was_in_ && (now ? rising : falling);
        was_in_ = now;

        const bool running = left_s_ > 0.0;
        if (running) {
            left_s_ = std::max(left_s_ - static_cast<double>(cycle.period_ns()) * 1e-9, 0.0);
        }
        if (edge && (!running || retriggerable)) {
            left_s_ = width;
        }
        time_left = left_s_;
        out = left_s_ > 0.0;  // FALSE for a width that is NaN
        out_not = !out;
    }

private:
    double left_s_ = 0.0;
    bool was_in_ = false;
    hal::Retained retained_{*this, {{"left-s", left_s_}, {"was-in", was_in_}}};
};

}  // namespace

HAL_COMPONENT(Oneshot, "oneshot", "Pulse of fixed duration after an edge", R"(
An edge of `in` sets `out` for `width` seconds, rounded up to whole cycles. `rising` and `falling`
select the edges. An edge during a pulse restarts it, or, with `retriggerable` FALSE, is ignored.

    loadrt oneshot names=lube
    addf lube servo
    setp lube.width 2.5
    net part-done => lube.in
    net lube-pump <= lube.out
)")
