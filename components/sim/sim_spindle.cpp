// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct SimSpindle : hal::Component {
    using Component::Component;
    hal::In<double>    velocity_cmd{*this, "velocity-cmd", "commanded speed"};
    hal::Out<double>   position_fb{*this, "position-fb", "position", {.unit = "turn"}};
    hal::Io<bool>      index_enable{*this, "index-enable", "TRUE: the next full turn sets position-fb to 0 and this pin to FALSE"};
    hal::Param<double> scale{*this, "scale", "turns per second, per unit of velocity-cmd", {.initial = 1.0}};
    hal::Function      run{*this, "", &SimSpindle::update, "turns the spindle"};

    void update(hal::Cycle cycle) noexcept {
        const double step = velocity_cmd * scale * cycle.seconds();
        // Above 1e9 turns the resolution is too low for an index; the spindle stops there.
        if (const double next = turns_ + step; std::fabs(next) <= 1e9) {
            const double passed = step < 0.0 ? std::ceil(turns_) - 1.0 : std::floor(turns_) + 1.0;
            if (index_enable && (step > 0.0 ? next >= passed : step < 0.0 && next <= passed)) {
                zero_ = step > 0.0 ? std::floor(next) : std::ceil(next);
                index_enable = false;
            }
            turns_ = next;
        }
        position_fb = turns_ - zero_;
    }

private:
    double turns_ = 0.0, zero_ = 0.0;
};

}  // namespace

HAL_COMPONENT(SimSpindle, "sim_spindle", "Simulated spindle with an index", R"(
Turns at `velocity-cmd` * `scale` turns per second, without acceleration. While `index-enable` is TRUE the next full turn, in either direction, sets
`position-fb` to 0 and clears `index-enable`.

    loadrt sim_spindle names=spindle-sim
    addf spindle-sim servo
    setp spindle-sim.scale 0.01666667
    net spindle-rpm   => spindle-sim.velocity-cmd
    net spindle-index => spindle-sim.index-enable
    net spindle-turns <= spindle-sim.position-fb
)")
