// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>

#include "hal/component.hpp"
#include "hal/interruption.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

struct SampledPid : hal::Component {
    using Component::Component;

    hal::In<bool> trigger{*this, "trigger",
                          "TRUE: feedback is a new sample; the controller computes once"};
    hal::In<bool> enable{*this,
                         "enable",
                         "FALSE resets the controller and forces the output to 0",
                         {.initial = true}};
    hal::In<double> command{*this, "command", "setpoint"};
    hal::In<double> feedback{*this, "feedback", "sample of the measured value"};
    hal::In<double> delay{
        *this, "delay", "time between a sample and its output; 0: the same cycle", {.unit = "s"}};

    hal::Param<double> gain{*this, "gain", "proportional gain K", {.initial = 1.0}};
    hal::Param<double> integral_time{
        *this, "integral-time", "integral time Ti; 0: no integral part", {.unit = "s"}};
    hal::Param<double> derivative_time{
        *this, "derivative-time", "derivative time Td", {.unit = "s"}};
    hal::Param<double> filter{
        *this, "filter", "N: the derivative is filtered with Td / N", {.initial = 10.0}};
    hal::Param<double> weight{*this,
                              "setpoint-weight",
                              "b: share of the setpoint in the proportional part",
                              {.initial = 1.0}};
    hal::Param<double> period{*this,
                              "sample-period",
                              "h: designed time between two samples",
                              {.initial = 0.01, .unit = "s"}};
    hal::OptionalLimitParam limit{*this, "max-output", "limit on the output; 0: no limit"};

    hal::Out<double> output{
        *this, "output", "control effort of the newest sample", {.safe = 0.0, .finite = true}};
    hal::Out<bool> fresh{*this, "new",
                         "TRUE for the cycle in which output is that of another sample"};

    hal::Function run{*this, "update", &SampledPid::update, "computes when there is a new sample"};

    void update(hal::Cycle cycle) noexcept {
        if (!enable) {
            integral_ = derivative_ = 0.0;
            waiting_ = 0;
            started_ = false;
        } else if (trigger && std::isfinite(command + feedback)) {
            compute();
        }
        bool changed = false;
        while (waiting_ != 0 && queue_[first_].at_ns <= cycle.start_ns()) {
            output = queue_[first_].value;
            first_ = (first_ + 1) % queue_.size();
            --waiting_;
            changed = true;
        }
        if (enable && trigger && std::isfinite(command + feedback)) {
            const double late = std::isfinite(delay) ? std::clamp(delay.get(), 0.0, 1e3) : 0.0;
            if (late * 1e9 < 1.0 || waiting_ == queue_.size()) {
                output = next_;
                waiting_ = 0;
                changed = true;
            } else {
                queue_[(first_ + waiting_++) % queue_.size()] = {
                    cycle.start_ns() + static_cast<std::int64_t>(std::llround(late * 1e9)), next_};
            }
        }
        if (!enable) {
            output = 0.0;
        }
        fresh = changed;
    }

private:
    /// u = K (b r - y) + I + D;  I += K h / Ti (r - y) after its use;  D = a D - K Td N / (Td + N
    /// h) (y - y_before), a = Td / (Td + N h).
    void compute() noexcept {
        const double h = period > 0.0 ? period.get() : 1e-3;
        const double td = std::fmax(derivative_time, 0.0);

        const double n = std::fmax(filter, 1e-9);
        if (interruption_.accept()) {
            started_ = false;
            derivative_ = 0.0;
        }
        if (!started_) {
            before_ = feedback;
            started_ = true;
        }
        derivative_ =
            td / (td + n * h) * derivative_ - gain * td * n / (td + n * h) * (feedback - before_);
        before_ = feedback;
        const double wanted = gain * (weight * command - feedback) + integral_ + derivative_;
        const double max = std::fabs(limit);
        next_ = max > 0.0 ? std::clamp(wanted, -max, max) : wanted;
        const double error = command - feedback;
        // While the output is limited the integral changes only towards the range (conditional
        // integration).
        if (integral_time > 0.0 && (next_ == wanted || error * (wanted - next_) < 0.0)) {
            integral_ += gain * h / integral_time * error;
        }
        if (!std::isfinite(next_ + integral_ + derivative_)) {
            next_ = integral_ = derivative_ = 0.0;
        }
    }

    struct Pending {
        std::int64_t at_ns;
        double value;
    };
    std::array<Pending, 64> queue_{};
    std::size_t first_ = 0;
    std::size_t waiting_ = 0;
    double integral_ = 0.0;
    double derivative_ = 0.0;
    double before_ = 0.0;
    double next_ = 0.0;
    bool started_ = false;
    hal::Interruption interruption_{*this};
    hal::Retained retained_{*this,
                            {{"queue", queue_},
                             {"first", first_},
                             {"waiting", waiting_},
                             {"integral", integral_},
                             {"derivative", derivative_},
                             {"before", before_},
                             {"next", next_},
                             {"started", started_},
                             {"interruption", interruption_}}};
};

}  // namespace

HAL_COMPONENT(SampledPid, "sampled_pid", "A PID controller that computes when a sample arrives", R"(
    u = K (b r - y) + I + D
    I = I + K h / Ti (r - y)                                 after u
    D = a D - K Td N / (Td + N h) (y - y of the sample before),   a = Td / (Td + N h)

The discrete PID controller with setpoint weight and filtered derivative (K. J. Åström, B.
Wittenmark, *Computer-Controlled Systems*, third edition, section 8.5). Unlike `pid` it computes
once per sample, whatever the period of its thread: for a loop over a network, where `trigger` is
the arrival of a message. It uses the designed period h, not the time between two arrivals, as a
controller does that does not know of jitter.

`delay` holds each output back for a constant time after its sample: up to 64 outputs wait. While
`max-output` limits the output, the integral changes only towards the range. Samples that are NaN or
infinite are ignored.

    loadrt can_receive names=sample link=sim:loop id=0x6f0 fields=position:f32
    loadrt sampled_pid names=loop
    addf sample.update bus
    addf loop.update bus
    setp loop.gain 4.8
    setp loop.integral-time 0.11
    setp loop.derivative-time 0.0225
    setp loop.sample-period 0.01
    net arrived  sample.new      => loop.trigger
    net position sample.position => loop.feedback
)")
