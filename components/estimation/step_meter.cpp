// SPDX-License-Identifier: MIT
#include <cmath>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct StepMeter : hal::Component {
    using Component::Component;

    hal::In<double> command{*this, "command", "setpoint; a change starts a measurement"};
    hal::In<double> value{*this, "value", "measured value"};
    hal::Param<double> band{
        *this, "band", "tolerance for settling, as a fraction of the step", {.initial = 0.02}};

    hal::Out<double> overshoot{*this, "overshoot",
                               "overshoot beyond the command, as a fraction of the step"};
    hal::Out<double> rise_time{
        *this, "rise-time", "time from 10 % to 90 % of the step", {.unit = "s"}};
    hal::Out<double> settling_time{*this,
                                   "settling-time",
                                   "time from the step to the last value outside of the band",
                                   {.unit = "s"}};
    hal::Out<double> steady_error{
        *this, "steady-error",
        "command - value, averaged over the last tenth of the time since the step"};
    hal::Out<double> time{*this, "time", "time since the step", {.unit = "s"}};

    hal::Function run{*this, "update", &StepMeter::update, "measures"};

    void update(hal::Cycle cycle) noexcept {
        const double wanted = command;
        const double now = value;
        if (!std::isfinite(wanted + now)) return;
        if (!started_ || wanted != target_) {
            from_ = now;
            step_ = wanted - now;
            target_ = wanted;
            started_ = true;
            overshoot = 0.0;
            rise_time = 0.0;
            settling_time = 0.0;
            time = 0.0;
            tenth_ = -1.0;
            mean_ = wanted - now;
        }
        time = time + cycle.seconds();
        // an average whose time constant grows with the time since the step
        mean_ += (wanted - now - mean_) * std::fmin(1.0, cycle.seconds() / (0.1 * time));
        steady_error = mean_;
        if (step_ == 0.0) return;
        const double part = (now - from_) / step_;
        overshoot = std::fmax(overshoot, part - 1.0);
        if (tenth_ < 0.0 && part >= 0.1) {
            tenth_ = time;
        }
        if (rise_time == 0.0 && part >= 0.9 && tenth_ >= 0.0) {
            rise_time = time - tenth_;
        }
        if (std::fabs(part - 1.0) > band) {
            settling_time = time.get();
        }
    }

private:
    double from_ = 0.0;

private:
    double step_ = 0.0;

private:
    double target_ = 0.0;

private:
    double tenth_ = -1.0;

private:
    double mean_ = 0.0;
    bool started_ = false;
    hal::Retained retained_{*this,
                            {{"from", from_},
                             {"step", step_},
                             {"target", target_},
                             {"tenth", tenth_},
                             {"mean", mean_},
                             {"started", started_}}};
};

}  // namespace

HAL_COMPONENT(StepMeter, "step_meter",
              "Overshoot, rise time, settling time and steady error of a step", R"(
Each change of `command` starts a measurement from the current value; the outputs converge during
the step. A settling time equal to `time` means that the value has not settled. NaN and infinite
values are ignored.

    loadrt step_meter names=meter
    addf meter.update servo
    net push-wanted => meter.command
    net push        => meter.value
)")
