// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/limit.hpp"

namespace {

struct Integ : hal::Component {
    using Component::Component;
    hal::In<double>  in{*this, "in", "the input"};
    hal::In<double>  gain{*this, "gain", "factor of in", {.initial = 1.0}};
    hal::Out<double> out{*this, "out", "integral of gain * in over time"};
    hal::In<bool>    reset{*this, "reset", "TRUE sets out to 0"};
    hal::Limit       max{*this, "max", "highest output", {.initial = 1e20}};
    hal::Limit       min{*this, "min", "lowest output", {.initial = -1e20}};
    hal::Function    run{*this, "", hal::step<&Integ::update>, "integrates"};

    void update(hal::Cycle cycle) noexcept {
        const double sum = std::min(std::max(sum_ + gain * in * cycle.seconds(), min.get()), max.get());
        if (reset) sum_ = 0.0;
        else if (std::isfinite(sum)) sum_ = sum;
        out = sum_;
    }

private:
    double sum_ = 0.0;
};

}  // namespace

HAL_COMPONENT(Integ, "integ", "Integrator with gain, reset and limits", R"(
`out = out + gain * in * period`, limited to `min` and `max`, which also prevents wind-up. NaN inputs are ignored; while a limit
is NaN, its last valid value applies, and a fault is raised.

    loadrt integ names=distance
    addf distance servo
    net velocity      => distance.in
    net distance-zero => distance.reset
    net distance      <= distance.out
)")
