// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/limit.hpp"

namespace {

struct Limit1 : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "the value to limit"};
    hal::Out<double> out{*this, "out", "in, limited to min and max"};
    hal::Limit min{*this, "min", "lowest output", {.initial = -1e20}};
    hal::Limit max{*this, "max", "highest output", {.initial = 1e20}};
    hal::Function run{*this, "", hal::step<&Limit1::update>, "computes out"};

    // Not std::clamp: users may set min above max, and then max applies.
    void update(hal::Cycle) noexcept { out = std::min(std::max(in.get(), min.get()), max.get()); }
};

}  // namespace

HAL_COMPONENT(Limit1, "limit1", "Limits a value to a range", R"(
`out = min(max(in, min), max)`

If `min` is above `max`, `max` applies. A NaN input passes through unchanged, so that the consumer
can detect the fault. While `min` or `max` is NaN, its last valid value applies, and a fault is
raised. `limit2` also limits the slope, `limit3` the slope and the acceleration.

    loadrt limit1 names=torque-limit
    addf torque-limit servo
    setp torque-limit.min -2.5
    setp torque-limit.max 2.5
    net torque-wanted => torque-limit.in
    net torque        <= torque-limit.out
)")
