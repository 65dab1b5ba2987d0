// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/limit.hpp"

namespace {

struct Integ : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "the input"};
    hal::In<double> gain{*this, "gain", "factor of in", {.initial = 1.0}};
    hal::Out<double> out{*this, "out", "integral of gain * in over time"};
    hal::In<bool> reset{*this, "reset", "TRUE sets out to 0, within min and max"};
    hal::Limit max{*this, "max", "highest output", {.initial = 1e20}};
    hal::Limit min{*this, "min", "lowest output", {.initial = -1e20}};
    hal::Function run{*this, "", hal::step<&Integ::update>, "integrates"};

    void update(hal::Cycle cycle) noexcept {
        const double sum = reset ? 0.0 : out + gain * in * cycle.seconds();
        const double upper = sum > max ? max.get() : sum;
        const double limited = upper < min ? min.get() : upper;
        if (std::isfinite(limited)) {
            out = limited;
        }
    }
};

}  // namespace

HAL_COMPONENT(Integ, "integ", "Integrator with gain, reset and limits", R"(
`out = out + gain * in * period`, limited to `min` and `max`, which also prevents wind-up. If they
exclude 0, `reset` sets `out` to the nearer one. NaN and infinite inputs are ignored (LinuxCNC:
`out` remains NaN); while a limit is NaN, its last valid value applies, and a fault is raised. In
LinuxCNC 2.10~pre1 `reset` has no effect; this is the `reset` of 2.9.

    loadrt integ names=distance
    addf distance servo
    net velocity      => distance.in
    net distance-zero => distance.reset
    net distance      <= distance.out
)")
