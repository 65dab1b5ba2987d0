// SPDX-License-Identifier: MIT
// Moves an axis for a test, by jogging or back and forth, for steptest and axistest. The commanded position is an end point;
// the step generator or drive that follows it limits speed and acceleration.
#pragma once

#include <cmath>
#include <cstdint>

#include "hal/component.hpp"

namespace axis_test {

struct Mover : hal::Component {
    using Component::Component;
    hal::In<bool>          jog_minus{*this, "jog-minus", "TRUE jogs in the negative direction"};
    hal::In<bool>          jog_plus{*this, "jog-plus", "TRUE jogs in the positive direction"};
    hal::In<bool>          run{*this, "run", "TRUE moves back and forth around the initial position"};
    hal::In<double>        max_velocity{*this, "maxvel", "maximum speed"};
    hal::In<double>        amplitude{*this, "amplitude", "distance of each end from the initial position"};
    hal::In<std::int32_t>  direction{*this, "dir", "0: both sides, 1: positive side, 2: negative side"};
    hal::Out<double>       position_cmd{*this, "position-cmd", "commanded position"};
    hal::In<double>        position_fb{*this, "position-fb", "position feedback of the axis"};
    hal::Out<bool>         running{*this, "running", "TRUE while moving back and forth"};
    hal::Out<double>       run_target{*this, "run-target", "end that the axis is moving to"};
    hal::Out<double>       run_start{*this, "run-start", "initial position: feedback when run became TRUE"};
    hal::Out<double>       run_low{*this, "run-low", "lower end"};
    hal::Out<double>       run_high{*this, "run-high", "upper end"};
    hal::In<std::int32_t>  pause{*this, "pause", "pause at each end", {.unit = "s"}};
    hal::Param<double>     epsilon{*this, "epsilon", "tolerance for reaching an end", {.initial = 0.001}};
    hal::Out<double>       elapsed{*this, "elapsed", "time at this end", {.unit = "s"}};

protected:
    /// Runs one cycle; a jog commands a position `lead` ahead. [realtime]
    void move(double lead, double dt) noexcept {
        if (run && !was_running_) begin();
        was_running_ = run;
        running = run.get();
        if (run) return to_and_fro(dt);
        elapsed = 0.0;
        const double way = jog_plus == jog_minus || !(lead > 0.0) ? 0.0 : jog_plus ? lead : -lead;
        position_cmd = position_fb + way;
    }

private:
    void begin() noexcept {
        const double start = position_fb, half = std::fabs(amplitude);
        run_start = start;
        run_low = direction == 1 ? start : start - half;
        run_high = direction == 2 ? start : start + half;
        up_ = false;
        elapsed = 0.0;
    }
    void to_and_fro(double dt) noexcept {
        if (std::fabs(position_fb - (up_ ? run_high : run_low)) <= epsilon) {
            if (elapsed >= static_cast<double>(pause)) {
                up_ = !up_;
                elapsed = 0.0;
            } else {
                elapsed = elapsed + dt;
            }
        }
        run_target = up_ ? run_high : run_low;
        position_cmd = run_target;
    }
    bool was_running_ = false, up_ = false;
};

}  // namespace axis_test
