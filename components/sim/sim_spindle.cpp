// SPDX-License-Identifier: MIT
#include "hal/component.hpp"

namespace {

struct SimSpindle : hal::Component {
    using Component::Component;
    hal::In<double> velocity_cmd{*this, "velocity-cmd", "commanded speed"};
    hal::Out<double> position_fb{*this, "position-fb", "position", {.unit = "turn"}};
    hal::Io<bool> index_enable{
        *this, "index-enable",
        "TRUE: the next full turn sets position-fb to 0 and this pin to FALSE"};
    hal::Param<double> scale{
        *this, "scale", "turns per second, per unit of velocity-cmd", {.initial = 1.0}};
    hal::Function run{*this, "", &SimSpindle::update, "turns the spindle"};

    void update(hal::Cycle cycle) noexcept {
        const double step = velocity_cmd * scale * cycle.seconds();
        const double next = position_fb + step;
        // an infinite or invalid speed does not end in an invalid position
        if (!std::isfinite(next)) return;
        const bool indexed = index_enable && std::floor(position_fb) != std::floor(next);
        if (indexed) {
            index_enable = false;
        }
        const double turns = velocity_cmd < 0.0 ? std::ceil(next) : std::floor(next);
        position_fb = indexed ? next - turns : next;
    }
};

}  // namespace

HAL_COMPONENT(SimSpindle, "sim_spindle", "Simulated spindle with an index", R"(
Turns at `velocity-cmd` * `scale` turns per second, without acceleration. While `index-enable` is
TRUE the next full turn, in either direction, takes the full turns away from `position-fb` and
clears `index-enable`. Backwards from exactly a full turn the first cycle does. The position is held
while the speed is NaN or infinite.

    loadrt sim_spindle names=spindle-sim
    addf spindle-sim servo
    setp spindle-sim.scale 0.01666667
    net spindle-rpm   => spindle-sim.velocity-cmd
    net spindle-index => spindle-sim.index-enable
    net spindle-turns <= spindle-sim.position-fb
)")
