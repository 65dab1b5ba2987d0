// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Minmax : hal::Component {
    using Component::Component;
    hal::In<double> in{*this, "in", "the input"};
    hal::In<bool> reset{*this, "reset", "TRUE sets min and max to in"};
    hal::Out<double> max{*this, "max", "highest input since the start or the reset"};
    hal::Out<double> min{*this, "min", "lowest input since the start or the reset"};
    hal::Function run{*this, "", hal::step<&Minmax::update>, "updates min and max"};

    void update(hal::Cycle) noexcept {
        const double value = in;
        if (!std::isnan(value)) {
            max = reset ? value : std::max(max.get(), value);
            min = reset ? value : std::min(min.get(), value);
        }
    }
};

}  // namespace

HAL_COMPONENT(Minmax, "minmax", "Tracks the minimum and the maximum of a value", R"(
Both begin at 0: pulse `reset` once to begin with the input. While `reset` is TRUE, the input sets
both.

**Differences from LinuxCNC:** NaN inputs are ignored (LinuxCNC: with `reset` they set both outputs,
which then remain NaN).

    loadrt minmax names=error-range
    addf error-range servo
    net following-error => error-range.in
    net clear-range     => error-range.reset
    net worst-error     <= error-range.max
)")
