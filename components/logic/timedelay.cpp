// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Timedelay : hal::Component {
    using Component::Component;
    hal::In<bool>    in{*this, "in", "the input"};
    hal::Out<bool>   out{*this, "out", "the input, delayed"};
    hal::In<double>  on_delay{*this, "on-delay", "time for which in must be TRUE before out becomes TRUE", {.initial = 0.5, .unit = "s"}};
    hal::In<double>  off_delay{*this, "off-delay", "time for which in must be FALSE before out becomes FALSE", {.initial = 0.5, .unit = "s"}};
    hal::Out<double> elapsed{*this, "elapsed", "time for which in has differed from out", {.unit = "s"}};
    hal::Function    run{*this, "", hal::step<&Timedelay::update>, "measures the time"};

    void update(hal::Cycle cycle) noexcept {
        const bool now = in;
        waited_ns_ = now == state_ ? 0 : waited_ns_ + cycle.period_ns();
        const double waited_s = static_cast<double>(waited_ns_) / 1e9;  // from whole ns: 20 cycles of 1 ms are exactly 0.02
        elapsed = waited_s;
        if (!(waited_s < (now ? on_delay : off_delay))) {
            state_ = now;
            waited_ns_ = 0;  // a change back in the next cycle starts its own delay
        }
        out = state_;
    }

private:
    bool state_ = false;
    std::int64_t waited_ns_ = 0;  // time for which in has differed from state_
};

}  // namespace

HAL_COMPONENT(Timedelay, "timedelay", "Time-delay relay", R"(
`out` becomes TRUE when `in` has been TRUE for `on-delay` seconds without interruption, and FALSE when it has been FALSE for
`off-delay`. The time includes the cycle in which `in` changes, so `out` follows one cycle earlier than `q` of `ton` with the same time. A NaN delay
counts as 0.

    loadrt timedelay names=pressure-ok
    addf pressure-ok servo
    setp pressure-ok.on-delay 2
    setp pressure-ok.off-delay 0.1
    net pressure-switch => pressure-ok.in
    net air-ok          <= pressure-ok.out
)")
