// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>

#include "hal/component.hpp"
#include "hal/retained.hpp"

namespace {

struct SampleClock : hal::Component {
    using Component::Component;

    hal::In<bool> external{*this, "external", "if linked: TRUE takes a sample, instead of period"};
    hal::In<bool> echo_new{*this, "echo-new",
                           "TRUE: the effect of sample echo arrives in this cycle"};
    hal::In<std::uint32_t> echo{*this, "echo", "number of the sample whose effect arrives"};
    hal::Io<bool> reset{*this, "reset", "TRUE resets the statistics, and becomes FALSE"};
    hal::Param<double> period{
        *this, "period", "time between two samples", {.initial = 0.01, .unit = "s"}};
    hal::Param<double> phase{
        *this, "phase", "time of the first sample after the first cycle", {.unit = "s"}};

    hal::Out<bool> trigger{*this, "trigger", "TRUE for the cycle of a sample"};
    hal::Out<std::uint32_t> sequence{*this, "sequence", "number of the newest sample, from 1"};
    hal::Out<double> delay{
        *this, "delay", "time from the newest sample with an effect to that effect", {.unit = "s"}};
    hal::Out<double> min{*this, "delay-min", "shortest delay", {.unit = "s"}};
    hal::Out<double> max{*this, "delay-max", "longest delay", {.unit = "s"}};
    hal::Out<double> mean{*this, "delay-mean", "mean delay", {.unit = "s"}};
    hal::Out<double> deviation{*this, "delay-sd", "standard deviation of the delay", {.unit = "s"}};
    hal::Out<double> jitter{*this, "jitter", "delay-max - delay-min", {.unit = "s"}};
    hal::Out<std::uint32_t> measured{*this, "measured", "samples with an effect"};
    hal::Out<std::uint32_t> overtaken{*this, "overtaken",
                                      "samples without an effect before that of a later one"};

    hal::Function begin{*this, "sample", &SampleClock::sample, "takes a sample when it is due"};
    hal::Function end{*this, "measure", &SampleClock::measure,
                      "measures the delay of an effect that arrives"};

    void sample(hal::Cycle cycle) noexcept {
        bool due = external;
        if (!external.linked()) {
            const double wanted = period * 1e9;
            const double late = phase * 1e9;
            due = false;
            if (wanted >= 1.0 && wanted < 1e18 && std::fabs(late) < 1e18) {
                if (!started_) {
                    begin_ns_ = cycle.start_ns() + std::llround(late);
                    started_ = true;
                }
                const std::int64_t since = cycle.start_ns() - begin_ns_;

                const std::int64_t step = std::llround(wanted);
                const std::int64_t instant = since >= 0 ? since / step : -1;
                due = instant != last_ && instant >= 0;
                last_ = instant;
            }
        }
        trigger = due;
        if (!due) return;
        sequence = sequence + 1;
        taken_[sequence % taken_.size()] = {sequence, cycle.start_ns()};
    }

    void measure(hal::Cycle cycle) noexcept {
        if (reset) {
            measured = 0;
            overtaken = 0;
            square_ = 0.0;
            delay = 0.0;
            min = 0.0;
            max = 0.0;
            mean = 0.0;
            deviation = 0.0;
            jitter = 0.0;
            reset = false;
        }
        if (!echo_new) return;
        const Taken& taken = taken_[echo % taken_.size()];
        if (taken.number != echo || echo == 0) return;
        if (echo > newest_ + 1 && newest_ != 0) {
            overtaken = overtaken + (echo - newest_ - 1);
        }
        newest_ = std::max(newest_, echo.get());
        const double d = 1e-9 * static_cast<double>(cycle.start_ns() - taken.at_ns);
        const bool first = measured == 0;
        measured = measured + 1;
        delay = d;
        min = first ? d : std::fmin(min, d);
        max = first ? d : std::fmax(max, d);
        // B. P. Welford, Note on a method for calculating corrected sums of squares and products,
        // Technometrics 4 (1962)
        const double off = d - mean;
        const double count = measured;
        mean = mean + off / count;
        square_ += off * (d - mean);
        deviation = std::sqrt(std::fmax(square_, 0.0) / count);
        jitter = max - min;
    }

private:
    struct Taken {
        std::uint32_t number;
        std::int64_t at_ns;
    };
    std::array<Taken, 256> taken_{};
    double square_ = 0.0;
    std::int64_t begin_ns_ = 0;
    std::int64_t last_ = -1;
    std::uint32_t newest_ = 0;
    bool started_ = false;
    hal::Retained retained_{*this,
                            {{"taken", taken_},
                             {"square", square_},
                             {"begin-ns", begin_ns_},
                             {"last", last_},
                             {"newest", newest_},
                             {"started", started_}}};
};

}  // namespace

HAL_COMPONENT(SampleClock, "sample_clock",
              "Times the samples of a loop over a network, and measures their delay", R"(
`sample` numbers the samples: one every `period`, or in each cycle in which `external` is TRUE. The
number travels with the sample through controller and network; `measure` compares the returned
`echo` with the time at which that sample was taken. The resolution is the period of the thread.

`jitter` is the difference between the longest and the shortest delay since `reset`. The last 256
samples are known; older echoes are ignored.

    loadrt sample_clock names=sampling
    loadrt sampled_pid names=loop
    addf sampling.sample bus
    addf loop.update bus
    addf sampling.measure bus
    setp sampling.period 0.01
    net sampled sampling.trigger  => loop.trigger
    net effect  loop.new          => sampling.echo-new
    net number  sampling.sequence => sampling.echo
)")
