// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Oneshot : hal::Component {
    using Component::Component;
    hal::In<bool>    in{*this, "in", "an edge starts the pulse"};
    hal::In<bool>    reset{*this, "reset", "TRUE ends the pulse and prevents new ones"};
    hal::Out<bool>   out{*this, "out", "TRUE during the pulse"};
    hal::Out<bool>   out_not{*this, "out-not", "FALSE during the pulse", {.initial = true}};
    hal::In<double>  width{*this, "width", "duration of the pulse", {.unit = "s"}};
    hal::Out<double> time_left{*this, "time-left", "remaining time of the pulse", {.unit = "s"}};
    hal::Param<bool> retriggerable{*this, "retriggerable", "TRUE: an edge during the pulse restarts it", {.initial = true}};
    hal::Param<bool> rising{*this, "rising", "TRUE: rising edges start a pulse", {.initial = true}};
    hal::Param<bool> falling{*this, "falling", "TRUE: falling edges start a pulse"};
    hal::Function    run{*this, "", hal::step<&Oneshot::update>, "turns edges into pulses"};

    void update(hal::Cycle cycle) noexcept {
        const bool now = in;
        const bool edge = started_ && now != was_in_ && (now ? rising : falling);
        was_in_ = now;
        started_ = true;

        left_ns_ = std::max<std::int64_t>(left_ns_ - cycle.period_ns(), 0);
        if (reset) left_ns_ = 0;
        else if (edge && (left_ns_ == 0 || retriggerable)) left_ns_ = width_ns();
        out = left_ns_ > 0;
        out_not = left_ns_ == 0;
        time_left = static_cast<double>(left_ns_) / 1e9;
    }

private:
    std::int64_t width_ns() const {
        const double ns = width * 1e9;
        return ns >= 9e18 ? INT64_MAX : ns > 0.0 ? std::llround(ns) : 0;  // NaN: no pulse
    }
    std::int64_t left_ns_ = 0;
    bool started_ = false, was_in_ = false;
};

}  // namespace

HAL_COMPONENT(Oneshot, "oneshot", "Pulse of fixed duration after an edge", R"(
An edge of `in` sets `out` for `width` seconds, rounded up to whole cycles. `rising` and `falling` select the
edges. An edge during a pulse restarts it, or, with `retriggerable` FALSE, is ignored.

    loadrt oneshot names=lube
    addf lube servo
    setp lube.width 2.5
    net part-done => lube.in
    net lube-pump <= lube.out
)")
