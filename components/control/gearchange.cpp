// SPDX-License-Identifier: MIT
#include "hal/component.hpp"
#include "hal/corrected.hpp"
#include "hal/limit.hpp"

namespace {

struct Gearchange : hal::Component {
    using Component::Component;
    hal::In<bool> sel{*this, "sel", "TRUE: gear 2, FALSE: gear 1"};
    hal::In<double> speed_in{*this, "speed-in", "commanded spindle speed"};
    hal::Out<double> speed_out{
        *this, "speed-out", "speed for the drive, scaled for gear 1", {.safe = 0.0}};
    hal::In<bool> dir_in{*this, "dir-in", "commanded direction"};
    hal::Out<bool> dir_out{*this, "dir-out", "direction for the drive"};
    hal::LimitParam min1{*this, "min1", "lowest speed in gear 1"};
    hal::LimitParam max1{*this, "max1", "highest speed in gear 1", {.initial = 100000.0}};
    hal::LimitParam min2{*this, "min2", "lowest speed in gear 2"};
    hal::LimitParam max2{*this, "max2", "highest speed in gear 2", {.initial = 100000.0}};
    hal::CorrectedParam<double> scale2{
        *this,
        "scale2",
        "ratio of the spindle speeds in gear 2 and gear 1; at least 1",
        {.initial = 1.0}};
    hal::Param<bool> reverse{*this, "reverse",
                             "TRUE: gear 2 reverses the direction of the spindle"};
    hal::Function run{*this, "", &Gearchange::update, "computes speed-out and dir-out"};

    void update(hal::Cycle) noexcept {
        if (!(scale2 >= 1.0)) {
            scale2.correct(1.0);
        }
        if (sel) {
            speed_out = within(speed_in, min2, max2, scale2);
            dir_out = dir_in != reverse;
        } else {
            speed_out = within(speed_in, min1, max1, 1.0);
            dir_out = dir_in;
        }
    }

private:
    /// Returns `speed` with its magnitude between `min` and `max`, divided by `ratio`.
    static double within(double speed, double min, double max, double ratio) noexcept {
        const double magnitude = std::fabs(speed);
        const double upper = magnitude > max ? max : magnitude;
        const double limited = magnitude >= min ? upper : min;  // also for NaN
        return (speed < 0.0 ? -limited : limited) / ratio;
    }
};

}  // namespace

HAL_COMPONENT(Gearchange, "gearchange", "Scales and limits a spindle speed for one of two gears",
              R"(
| sel   | speed-out | dir-out |
| ----- | --- | --- |
| FALSE | speed-in between min1 and max1 | dir-in |
| TRUE  | (speed-in between min2 and max2) / scale2 | dir-in, inverted while reverse is TRUE |

Scale the drive for gear 1; `scale2` is the ratio of the spindle speeds in gear 2 and gear 1 at the
same drive speed. Gear 2 is the high gear: a `scale2` below 1, or NaN, is set to 1. The limits are
spindle speeds in either direction: a negative `speed-in` is limited to the range from -max to -min.
Below the minimum, the minimum applies, even if it is above the maximum. While `speed-in` is NaN,
the minimum applies (LinuxCNC: NaN).

    loadrt gearchange names=gears
    addf gears servo
    setp gears.max1 800
    setp gears.min2 500
    setp gears.max2 2500
    setp gears.scale2 3.2
    net high-gear    => gears.sel
    net spindle-cmd  => gears.speed-in
    net spindle-volt <= gears.speed-out
)")
