// SPDX-License-Identifier: MIT
#include <cmath>

#include "hal/component.hpp"

namespace {

struct StepMeter : hal::Component {
    using Component::Component;

    hal::In<double>    command{*this, "command", "the wanted value; a change of it starts a measurement"};
    hal::In<double>    value{*this, "value", "the real one"};
    hal::Param<double> band{*this, "band", "settled: this part of the step away from the command", {.initial = 0.02}};

    hal::Out<double> overshoot{*this, "overshoot", "largest value beyond the command, as a part of the step"};
    hal::Out<double> rise_time{*this, "rise-time", "from 10 % to 90 % of the step", {.unit = "s"}};
    hal::Out<double> settling_time{*this, "settling-time", "from the step to the last time outside of the band", {.unit = "s"}};
    hal::Out<double> steady_error{*this, "steady-error", "command - value of now, averaged over the last tenth of the time since the step"};
    hal::Out<double> time{*this, "time", "since the step", {.unit = "s"}};

    hal::Function run{*this, "update", &StepMeter::update, "measures"};

    void update(hal::Cycle cycle) noexcept {
        const double wanted = command, now = value;
        if (!std::isfinite(wanted + now)) return;
        if (!started_ || wanted != target_) {
            from_ = now, step_ = wanted - now, target_ = wanted, started_ = true;
            overshoot = 0.0, rise_time = 0.0, settling_time = 0.0, time = 0.0;
            tenth_ = -1.0;
            mean_ = wanted - now;
        }
        time = time + cycle.seconds();
        // an average that forgets as fast as the measurement grows old
        mean_ += (wanted - now - mean_) * std::fmin(1.0, cycle.seconds() / (0.1 * time));
        steady_error = mean_;
        if (step_ == 0.0) return;
        const double part = (now - from_) / step_;
        overshoot = std::fmax(overshoot, part - 1.0);
        if (tenth_ < 0.0 && part >= 0.1) tenth_ = time;
        if (rise_time == 0.0 && part >= 0.9 && tenth_ >= 0.0) rise_time = time - tenth_;
        if (std::fabs(part - 1.0) > band) settling_time = time.get();
    }

private:
    double from_ = 0.0, step_ = 0.0, target_ = 0.0, tenth_ = -1.0, mean_ = 0.0;
    bool   started_ = false;
};

}  // namespace

HAL_COMPONENT(StepMeter, "step_meter", "Overshoot, rise time, settling time and steady error of a step", R"(
Each change of `command` starts a measurement from the value of that moment; the outputs grow true as the step goes on. A settling time that
is as long as `time` means that it has not settled. A value that is no number is left out.

    loadrt step_meter names=judge
    addf judge.update servo
    net push-wanted => judge.command
    net push        => judge.value
)")
