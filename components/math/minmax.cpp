// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct Minmax : hal::Component {
    using Component::Component;
    hal::In<double>  in{*this, "in", "the input"};
    hal::In<bool>    reset{*this, "reset", "TRUE sets min and max to in"};
    hal::Out<double> max{*this, "max", "highest input since the reset"};
    hal::Out<double> min{*this, "min", "lowest input since the reset"};
    hal::Function    run{*this, "", hal::step<&Minmax::update>, "updates min and max"};

    void update(hal::Cycle) noexcept {
        const double value = in;
        if (!std::isnan(value)) {
            const bool first = reset || !started_;
            highest_ = first ? value : std::max(highest_, value);
            lowest_ = first ? value : std::min(lowest_, value);
            started_ = true;
        }
        max = highest_;
        min = lowest_;
    }

private:
    double highest_ = 0.0, lowest_ = 0.0;
    bool started_ = false;
};

}  // namespace

HAL_COMPONENT(Minmax, "minmax", "Tracks the minimum and the maximum of a value", R"(
The first input, and any input while `reset` is TRUE, sets both. NaN inputs are ignored.

    loadrt minmax names=error-range
    addf error-range servo
    net following-error => error-range.in
    net clear-range     => error-range.reset
    net worst-error     <= error-range.max
)")
