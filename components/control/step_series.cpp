// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

/// Mean, standard deviation and maximum of a series (B. P. Welford, Technometrics 4, 1962).
struct Series {
    Series(hal::Component& c, const char* name, const char* doc, const char* unit)
        : mean(c, (std::string(name) + "-mean").c_str(),
               (std::string(doc) + ", mean of the steps").c_str(), {.unit = unit}),
          deviation(c, (std::string(name) + "-sd").c_str(),
                    (std::string(doc) + ", standard deviation").c_str(), {.unit = unit}),
          max(c, (std::string(name) + "-max").c_str(), (std::string(doc) + ", worst step").c_str(),
              {.unit = unit}),
          retained_(c, {{"square", square_}}) {}

    void add(double value, std::uint32_t count) noexcept {
        if (count == 1) {
            mean = 0.0;
            square_ = 0.0;
            max = value;
        }
        const double off = value - mean;
        mean = mean + off / count;
        square_ += off * (value - mean);
        deviation = std::sqrt(std::fmax(square_, 0.0) / count);
        max = std::fmax(max, value);
    }
    hal::Out<double> mean, deviation, max;

private:
    double square_ = 0.0;
    hal::Retained retained_;
};

struct StepSeries : hal::Component {
    using Component::Component;

    hal::In<bool> trigger{*this, "trigger", "TRUE: a sample is taken in this cycle"};
    hal::In<double> value{*this, "value", "measured value"};
    hal::Param<std::uint32_t> samples{
        *this, "samples", "samples from one step to the next", {.initial = 120}};
    hal::Param<double> size{*this, "size", "size of the steps", {.initial = 1.0}};
    hal::Param<double> band{
        *this, "band", "tolerance for settling, as a fraction of the step", {.initial = 0.02}};

    hal::Out<double> command{*this, "command", "setpoint: 0 and size in turn"};
    hal::Out<double> response{*this, "response", "value as a fraction of the step, from 0 to 1"};
    hal::Out<double> time{*this, "time", "time since the step", {.unit = "s"}};
    hal::Out<std::uint32_t> steps{*this, "steps", "complete steps, without the first"};
    Series overshoot{*this, "overshoot", "overshoot beyond the step, as a fraction of it", ""};
    Series settling{*this, "settling", "time from the step to the last value outside of the band",
                    "s"};
    Series itae{*this, "itae",
                "integral of time times the absolute error, as a fraction of the step", "s^2"};

    hal::Function run{*this, "update", &StepSeries::update,
                      "steps the setpoint and measures the response"};

    void update(hal::Cycle cycle) noexcept {
        if (trigger && count_++ % std::max<std::uint32_t>(samples, 1) == 0) {
            begin();
        }
        if (!started_) return;
        time = since_;
        response = (value - from_) / (command - from_);
        const double off = std::isfinite(response) ? response - 1.0 : 0.0;
        peak_ = std::fmax(peak_, off);
        if (std::fabs(off) > band) {
            settled_ = since_;
        }
        sum_ += since_ * std::fabs(off) * cycle.seconds();
        since_ += cycle.seconds();
    }

private:
    void begin() noexcept {
        // The first step begins with a loop that was just switched on; it is not counted.
        if (number_++ >= 2) {
            steps = steps + 1;
            overshoot.add(peak_, steps);
            settling.add(settled_, steps);
            itae.add(sum_, steps);
        }
        from_ = command;
        const double step = size != 0.0 ? size.get() : 1.0;
        command = command == 0.0 ? step : 0.0;
        started_ = true;
        since_ = peak_ = settled_ = sum_ = 0.0;
    }

    double from_ = 0.0;
    double since_ = 0.0;
    double peak_ = 0.0;
    double settled_ = 0.0;
    double sum_ = 0.0;
    std::uint32_t count_ = 0;
    std::uint32_t number_ = 0;
    bool started_ = false;
    hal::Retained retained_{*this,
                            {{"from", from_},
                             {"since", since_},
                             {"peak", peak_},
                             {"settled", settled_},
                             {"sum", sum_},
                             {"count", count_},
                             {"number", number_},
                             {"started", started_}}};
};

}  // namespace

HAL_COMPONENT(StepSeries, "step_series", "Repeats a step and keeps statistics of the responses", R"(
Every `samples` samples the setpoint changes between 0 and `size`. Each response is measured until
the next step: overshoot and settling as in `step_meter`, and ITAE, the integral of t |1 - y|. The
outputs are the mean, the standard deviation and the maximum over all complete steps but the first.
`samples` should be long enough for the loop to settle; a loop that has not settled in the time of a
step counts with that time.

For an experiment in which one response is not enough, because a disturbance has another phase in
each of them.

    loadrt step_series names=steps
    addf steps.update bus
    net sampled  => steps.trigger
    net position => steps.value
    net wanted   <= steps.command
)")
