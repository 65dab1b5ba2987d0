// SPDX-License-Identifier: MIT
// Moves an axis for a test, by jogging or back and forth, for steptest and axistest. The commanded
// position is an end point; the step generator or drive that follows it limits speed and
// acceleration.
#pragma once

#include <cmath>
#include <cstdint>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace axis_test {

struct Mover : hal::Component {
    using Component::Component;
    hal::In<bool> jog_minus{*this, "jog-minus", "TRUE jogs in the negative direction"};
    hal::In<bool> jog_plus{*this, "jog-plus", "TRUE jogs in the positive direction"};
    hal::In<bool> run{*this, "run",
                      "TRUE moves back and forth around the initial position; FALSE returns to it"};
    hal::In<double> max_velocity{*this, "maxvel", "maximum speed"};
    hal::In<double> amplitude{
        *this, "amplitude",
        "distance of each end from the initial position; negative: the ends are exchanged"};
    hal::In<std::int32_t> direction{*this, "dir",
                                    "0: both sides, 1: positive side, 2: negative side"};
    hal::Out<double> position_cmd{*this, "position-cmd", "commanded position"};
    hal::In<double> position_fb{*this, "position-fb", "position feedback of the axis"};
    hal::Out<bool> running{*this, "running",
                           "TRUE from run until the axis is back at the initial position"};
    hal::Out<double> run_target{*this, "run-target",
                                "position that the axis is moving to while running is TRUE"};
    hal::Out<double> run_start{*this, "run-start",
                               "initial position: feedback when run became TRUE"};
    hal::Out<double> run_low{*this, "run-low", "lower end"};
    hal::Out<double> run_high{*this, "run-high", "upper end"};
    hal::In<std::int32_t> pause{*this, "pause", "pause at each end", {.unit = "s"}};
    hal::Param<double> epsilon{
        *this, "epsilon", "tolerance for reaching an end", {.initial = 0.001}};
    hal::Out<double> elapsed{*this, "elapsed", "time at this end", {.unit = "s"}};

protected:
    /// Runs one cycle. Returns true in the cycles in which the axis is neither running nor
    /// returning: the caller then commands a jog. [realtime]
    bool free_to_jog(double dt) noexcept {
        if (pausing_) {
            paused_s_ += dt;
        }
        elapsed = paused_s_;
        if (run) {
            if (!running) {
                begin();
            }
            to_and_fro();
        } else if (running) {
            go_back();
        } else {
            return true;
        }
        run_target = position_cmd.get();
        return false;
    }

    bool is_at(double position) const noexcept {
        return std::fabs(position_fb - position) < epsilon;
    }

private:
    void begin() noexcept {
        running = true;
        run_start = position_fb;
        run_high = direction == 2 ? run_start : run_start + amplitude;
        run_low = direction == 1 ? run_start : run_start - amplitude;
        position_cmd = run_low.get();
    }

    void to_and_fro() noexcept {
        const bool commanded_an_end = position_cmd == run_low || position_cmd == run_high;
        if (!commanded_an_end || !is_at(position_cmd)) return;
        if (!pausing_) {
            pausing_ = true;
            paused_s_ = 0.0;
        } else if (paused_s_ >= static_cast<double>(pause)) {
            pausing_ = false;
            position_cmd = position_cmd == run_low ? run_high : run_low;
        }
    }

    void go_back() noexcept {
        position_cmd = run_start.get();
        if (!is_at(run_start)) return;
        running = false;
        pausing_ = false;
    }

    bool pausing_ = false;   // at an end
    double paused_s_ = 0.0;  // since the axis reached the end
    hal::Retained retained_{*this, {{"pausing", pausing_}, {"paused-s", paused_s_}}};
};

}  // namespace axis_test
