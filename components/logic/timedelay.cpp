// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Timedelay : hal::Component {
    using Component::Component;
    hal::In<bool>    in{*this, "in", "the input"};
    hal::Out<bool>   out{*this, "out", "follows in after the delay"};
    hal::In<double>  on_delay{*this, "on-delay", "how long in must be TRUE before out becomes TRUE", {.initial = 0.5, .unit = "s"}};
    hal::In<double>  off_delay{*this, "off-delay", "how long in must be FALSE before out becomes FALSE", {.initial = 0.5, .unit = "s"}};
    hal::Out<double> elapsed{*this, "elapsed", "for how long in has differed from out", {.unit = "s"}};
    hal::Function    run{*this, "", &Timedelay::update, "runs the timer"};

    void update(hal::Cycle cycle) noexcept {
        const bool wanted = in;
        waited_ns_ = wanted == state_ ? 0 : waited_ns_ + cycle.period_ns();
        // The quotient is correctly rounded, so it compares equal to a delay written with the same digits.
        const double waited = static_cast<double>(waited_ns_) / 1e9;
        if (waited_ns_ != 0 && waited >= (wanted ? on_delay : off_delay)) {
            state_ = wanted;
            waited_ns_ = 0;
        }
        elapsed = waited;
        out = state_;
    }

private:
    std::int64_t waited_ns_ = 0;
    bool state_ = false;
};

}  // namespace

HAL_COMPONENT(Timedelay, "timedelay", "Time-delay relay", R"(
`out` becomes TRUE when `in` has been TRUE for `on-delay` without a break, and FALSE when it has been FALSE for
`off-delay`. Delays are rounded up to whole cycles; a delay of 0 follows at once.

    loadrt timedelay names=fan
    addf fan servo
    setp fan.on-delay 0
    setp fan.off-delay 30
    net spindle-on => fan.in
    net fan-on     <= fan.out
)")
