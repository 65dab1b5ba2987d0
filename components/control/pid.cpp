// SPDX-License-Identifier: MIT
#include <limits>
#include <numbers>

#include "hal/component.hpp"
#include "hal/interruption.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"

namespace {

/// Clamps `value` to ±|limit|; a limit of 0 disables the clamp.
double limited(double value, double limit) {
    const double bound = std::fabs(limit);
    if (bound > 0.0) {
        if (value < -bound) return -bound;
        if (value > bound) return bound;
        return value;  // NaN passes
    }
    return value;
}

/// A gain that auto-tuning may set. It is an input: a linked signal takes precedence.
class Gain : public hal::In<double> {
public:
    using In::In;
    void tune(double value) noexcept {
        if (!linked()) {
            put(value);
        }
    }
};

struct alignas(64) Pid : hal::Component {
    using Component::Component;
    static constexpr hal::Traits traits{.default_count = 3};

    hal::In<double> command{*this, "command", "setpoint"};
    hal::In<double> feedback{*this, "feedback", "measured value"};
    hal::Out<double> error{*this, "error", "command - feedback", {.finite = true}};
    hal::Out<double> output{*this, "output", "control effort", {.safe = 0.0}};
    hal::In<bool> enable{*this, "enable",
                         "TRUE closes the loop; FALSE clears the integral and forces output to 0"};
    hal::In<bool> index_enable{
        *this, "index-enable",
        "command and feedback jump in the cycle of its falling edge: derivatives are held"};
    hal::In<bool> error_previous_target{*this,
                                        "error-previous-target",
                                        "error = command of the previous cycle - feedback",
                                        {.initial = true}};
    hal::In<bool> tune_mode{*this, "tune-mode",
                            "TRUE opens the loop for auto-tuning: output is bias until tune-start"};
    Gain p_gain{*this, "Pgain", "proportional gain", {.initial = 1.0}};
    Gain i_gain{*this, "Igain", "integral gain"};
    Gain d_gain{*this, "Dgain", "derivative gain"};
    hal::In<double> ff0{*this, "FF0", "feed-forward of command"};
    Gain ff1{*this, "FF1", "feed-forward of the first derivative of command"};
    hal::In<double> ff2{*this, "FF2", "feed-forward of the second derivative of command"};
    hal::In<double> ff3{*this, "FF3", "feed-forward of the third derivative of command"};
    hal::In<double> bias{*this, "bias", "constant added to the output while enabled"};
    hal::In<double> deadband{*this, "deadband",
                             "smaller errors count as 0; larger ones are reduced by it"};
    hal::OptionalLimit max_error{*this, "maxerror", "limit on the error; 0: no limit"};
    hal::OptionalLimit max_error_i{*this, "maxerrorI",
                                   "limit on the integral of the error; 0: no limit"};
    hal::OptionalLimit max_error_d{*this, "maxerrorD",
                                   "limit on the derivative of the error; 0: no limit"};
    hal::OptionalLimit max_command_d{*this, "maxcmdD",
                                     "limit on the first derivative of command; 0: no limit"};
    hal::OptionalLimit max_command_dd{*this, "maxcmdDD",
                                      "limit on the second derivative of command; 0: no limit"};
    hal::OptionalLimit max_command_ddd{*this, "maxcmdDDD",
                                       "limit on the third derivative of command; 0: no limit"};
    hal::OptionalLimit max_output{*this, "maxoutput", "limit on the output; 0: no limit"};
    hal::In<double> command_deriv{*this, "command-deriv",
                                  "derivative of command; estimated while unlinked"};
    hal::In<double> feedback_deriv{*this, "feedback-deriv",
                                   "derivative of feedback; estimated while unlinked"};
    hal::Out<bool> saturated{*this, "saturated", "TRUE while maxoutput limits the output"};
    hal::Out<double> saturated_s{
        *this, "saturated-s", "time for which saturated has been TRUE", {.unit = "s"}};
    hal::Out<std::int32_t> saturated_count{*this, "saturated-count",
                                           "number of cycles for which saturated has been TRUE"};

    hal::Argument debug{
        *this, "debug", 0, "1 adds the pins errorI to ultimate-period", {.min = 0, .max = 1}};

private:
    // The state of the loop is beside the pins that every cycle uses, so that a cycle touches few
    // cache lines.
    double integral_ = 0.0;
    double pushing_ = 0.0;
    double last_command_ = 0.0;
    double last_feedback_ = 0.0;
    double slope_ = 0.0;
    double error_d_ = 0.0;
    double feedback_d_ = 0.0;
    double command_d_ = 0.0;
    double command_dd_ = 0.0;

    double command_ddd_ = 0.0;
    bool has_previous_ = false;
    bool was_index_enable_ = false;
    bool tuning_ = false;

public:
    hal::Io<bool> tune_start{*this, "tune-start", "TRUE starts auto-tuning; cleared when it ends"};
    hal::Io<std::uint32_t> tune_type{*this, "tune-type",
                                     "0 finds Pgain, Igain, Dgain; 1 finds Pgain, Igain, FF1"};
    hal::Io<std::uint32_t> tune_cycles{
        *this,
        "tune-cycles",
        "half cycles of the oscillation to average over, at least 30",
        {.initial = 50}};
    hal::Io<double> tune_effort{*this,
                                "tune-effort",
                                "amplitude of the output's oscillation around bias",
                                {.initial = 0.5}};

    hal::Outs<double> error_i_out{
        *this, "errorI", debug,
        "integral of the error, limited by maxerrorI, before Igain; 0 while not enabled"};
    hal::Outs<double> error_d_out{*this, "errorD", debug, "derivative of the error"};
    hal::Outs<double> command_d_out{*this, "commandD", debug, "first derivative of command"};
    hal::Outs<double> command_dd_out{*this, "commandDD", debug, "second derivative of command"};
    hal::Outs<double> command_ddd_out{*this, "commandDDD", debug, "third derivative of command"};
    hal::Outs<double> feedback_d_out{*this, "feedbackD", debug, "derivative of feedback"};
    hal::Outs<double> ultimate_gain{*this, "ultimate-gain", debug,
                                    "gain at which the loop would oscillate, found by auto-tuning"};
    hal::Outs<double> ultimate_period{
        *this, "ultimate-period", debug, "period of that oscillation", {.unit = "s"}};

    hal::Function run{*this, "do-pid-calcs", hal::step<&Pid::calculate>,
                      "runs one step of the control loop"};

    void calculate(hal::Cycle cycle) noexcept {
        const double dt = cycle.seconds();
        const bool at_index = was_index_enable_ & !index_enable;
        was_index_enable_ = index_enable;
        if (interruption_.accept()) {
            forget_previous();
        }

        // The first cycle, also after a stop, has no previous target, and at the index the previous
        // one is in the old coordinates.
        const bool use_previous = error_previous_target & has_previous_ & !at_index;
        const double deviation = (use_previous ? last_command_ : command.get()) - feedback;
        error = deviation;
        const double e = beyond_deadband(limited(deviation, max_error));
        const bool valid = std::isfinite(command - feedback);
        if (valid & has_previous_) {
            differentiate(at_index, 1.0 / dt);
        }
        last_command_ = command;
        last_feedback_ = feedback;
        has_previous_ = valid;

        if (enable & tune_mode) {
            tune(deviation, dt);
        } else {
            if (tuning_) {
                stop_tuning();
            }
            if (enable) {
                control(e, dt);
            } else {
                shut(0.0);
            }
        }
        if (debug != 0) {
            publish_debug();
        }
    }

private:
    double beyond_deadband(double e) const {
        const double band = std::fabs(deadband);
        if (e > band) return e - band;
        if (e < -band) return e + band;
        return e * 0.0;  // 0, or NaN
    }

    void forget_previous() {
        has_previous_ = false;
        slope_ = feedback_d_ = error_d_ = 0.0;
        command_d_ = command_dd_ = command_ddd_ = 0.0;
    }

    /// Estimates all derivatives, also while disabled, so that enabling causes no spike. The slope
    /// of the error is the slope of command minus the slope of feedback, unaffected by maxerror and
    /// deadband: it damps inside the deadband, too.
    void differentiate(bool at_index, double rate) {
        double slope =
            command_deriv.linked() ? command_deriv.get() : (command - last_command_) * rate;
        if (at_index & !command_deriv.linked()) {
            slope = slope_;
        }
        if (feedback_deriv.linked()) {
            feedback_d_ = feedback_deriv;
        } else if (!at_index) {
            feedback_d_ = (feedback - last_feedback_) * rate;
        }
        error_d_ = limited(slope - feedback_d_, max_error_d);
        slope_ = slope;

        const double command_d = limited(slope, max_command_d);
        const double command_dd = limited((command_d - command_d_) * rate, max_command_dd);
        command_ddd_ = limited((command_dd - command_dd_) * rate, max_command_ddd);
        command_dd_ = command_dd;
        command_d_ = command_d;
    }

    static double direction(double excess) {
        if (excess > 0.0) return 1.0;
        return excess < 0.0 ? -1.0 : 0.0;
    }

    void control(double e, double dt) {
        double integral = integral_;
        // while saturated, only away from the limit
        if (e * pushing_ <= 0.0) {
            integral = limited(integral + e * dt, max_error_i);
        }
        const double wanted = bias + p_gain * e + i_gain * integral + d_gain * error_d_ +
                              ff0 * command + ff1 * command_d_ + ff2 * command_dd_ +
                              ff3 * command_ddd_;
        const double given = limited(wanted, max_output);
        if (!std::isfinite(wanted)) {
            finish(0.0, 0.0, dt);
            return;
        }
        integral_ = integral;
        finish(given, direction(wanted - given), dt);
    }

    /// `pushing` is the direction in which the output is limited: -1, 0 or 1.
    void finish(double effort, double pushing, double dt) {
        const bool limiting = pushing != 0.0;
        pushing_ = pushing;
        output = effort;
        saturated = limiting;
        saturated_s = limiting ? saturated_s + dt : 0.0;
        saturated_count = limiting ? std::min(saturated_count.get(), INT32_MAX - 1) + 1 : 0;
    }

    /// Stops control: a constant output and a cleared integral.
    void shut(double effort) {
        integral_ = 0.0;
        finish(effort, 0.0, 0.0);
    }

    // Auto-tuning, the relay method of Åström and Hägglund (Automatica 20, 1984,
    // doi:10.1016/0005-1098(84)90014-1): the output switches between bias ± h with the sign of the
    // error, so that the loop oscillates at its ultimate frequency. With the amplitude a and the
    // period T of the error, the ultimate gain is K = 4 h / (pi a), and Ziegler and Nichols' table
    // gives
    //     PID:      Pgain = 0.6 K,   Igain = Pgain / (T / 2),    Dgain = Pgain T / 8
    //     PI, FF1:  Pgain = 0.45 K,  Igain = Pgain / (T / 1.2),  FF1 = 1
    void tune(double deviation, double dt) {
        if (tune_start && !tuning_) {
            tuning_ = true;
            direction_ = deviation >= 0.0 ? 1.0 : -1.0;
            half_cycles_ = -settling_half_cycles;
            peak_ = elapsed_ = amplitude_sum_ = time_sum_ = 0.0;
            period_ = periods_ = period_sum_ = period_squares_ = 0.0;
        }
        if (tuning_ && (!tune_start || !std::isfinite(deviation))) {
            stop_tuning();
        }
        if (!tuning_) return shut(limited(bias, max_output));

        elapsed_ += dt;
        peak_ = std::max(peak_, direction_ * deviation);
        if (direction_ * deviation < 0.0) {
            if (half_cycles_ >= 0) {
                amplitude_sum_ += peak_;
                time_sum_ += elapsed_;
                note_half_period();
            }
            direction_ = -direction_;
            peak_ = std::fabs(deviation);  // this sample is the first beyond zero
            elapsed_ = 0.0;
            if (++half_cycles_ >= std::max<std::int64_t>(tune_cycles.get(), min_half_cycles)) {
                if (oscillates_evenly()) {
                    adopt(amplitude_sum_ / static_cast<double>(half_cycles_),
                          2.0 * time_sum_ / static_cast<double>(half_cycles_));
                } else if (faults_ != nullptr) {
                    faults_->raise(faults_, this, uneven_oscillation,
                                   std::numeric_limits<double>::quiet_NaN());
                }
                stop_tuning();
                return shut(limited(bias, max_output));
            }
        }
        shut(limited(bias + direction_ * std::fabs(tune_effort), max_output));
    }

    /// Sums up the periods, of two half cycles each, and their squares.
    void note_half_period() {
        period_ += elapsed_;
        if (half_cycles_ % 2 == 0) return;
        periods_ += 1.0;
        period_sum_ += period_;
        period_squares_ += period_ * period_;
        period_ = 0.0;
    }
    /// Noise around zero switches the output as well, at random: the standard deviation of many
    /// periods is at least half their mean. That of an oscillation is a sampling period or two.
    bool oscillates_evenly() const {
        const double mean = period_sum_ / periods_;
        const double variance = period_squares_ / periods_ - mean * mean;
        return variance <= max_spread * max_spread * mean * mean;
    }

    void adopt(double amplitude, double period) {
        const double gain = 4.0 * std::fabs(tune_effort) / (std::numbers::pi * amplitude);
        if (!std::isfinite(gain) || !(gain > 0.0) || !(period > 0.0)) return;
        const bool with_ff1 = tune_type == 1;
        p_gain.tune((with_ff1 ? 0.45 : 0.6) * gain);
        i_gain.tune(with_ff1 ? 0.54 * gain / period : 1.2 * gain / period);
        d_gain.tune(with_ff1 ? 0.0 : 0.075 * gain * period);
        if (with_ff1) {
            ff1.tune(1.0);
        }
        ultimate_gain_ = gain;
        ultimate_period_ = period;
    }

    void stop_tuning() {
        tuning_ = false;
        tune_start = false;
    }

    void publish_debug() {
        error_i_out[0] = integral_;
        error_d_out[0] = error_d_;
        command_d_out[0] = command_d_;
        command_dd_out[0] = command_dd_;
        command_ddd_out[0] = command_ddd_;
        feedback_d_out[0] = feedback_d_;
        ultimate_gain[0] = ultimate_gain_;
        ultimate_period[0] = ultimate_period_;
    }

    // until the oscillation has its final shape
    static constexpr std::int64_t settling_half_cycles = 2;
    // White noise has 15 periods within the spread in one of 3000 tunings, 10 in one of 200.
    static constexpr std::int64_t min_half_cycles = 30;
    static constexpr double max_spread = 0.2;  // of the periods, of their mean
    static constexpr const char* uneven_oscillation =
        "auto-tuning failed: noise or a disturbance has switched the output, not the oscillation "
        "of the loop; the gains are unchanged; increase tune-effort, or filter the feedback";

    // While tuning: half cycles averaged (negative: still settling) and what was seen of the
    // present one.
    std::int64_t half_cycles_ = 0;
    double direction_ = 1.0;
    double peak_ = 0.0;
    double elapsed_ = 0.0;
    double amplitude_sum_ = 0.0;
    double time_sum_ = 0.0;
    double period_ = 0.0;  // its first half cycle
    double periods_ = 0.0;
    double period_sum_ = 0.0;
    double period_squares_ = 0.0;
    const hal_faults* const faults_ = hal::extension<hal_faults>("hal.faults/1");
    double ultimate_gain_ = 0.0;
    double ultimate_period_ = 0.0;
    hal::Interruption interruption_{*this};
    hal::Retained retained_{*this,
                            {{"integral", integral_},
                             {"interruption", interruption_},
                             {"pushing", pushing_},
                             {"last-command", last_command_},
                             {"last-feedback", last_feedback_},
                             {"slope", slope_},
                             {"error-d", error_d_},
                             {"feedback-d", feedback_d_},
                             {"command-d", command_d_},
                             {"command-dd", command_dd_},
                             {"command-ddd", command_ddd_},
                             {"has-previous", has_previous_},
                             {"was-index-enable", was_index_enable_},
                             {"tuning", tuning_},
                             {"half-cycles", half_cycles_},
                             {"direction", direction_},
                             {"peak", peak_},
                             {"elapsed", elapsed_},
                             {"amplitude-sum", amplitude_sum_},
                             {"time-sum", time_sum_},
                             {"period", period_},
                             {"periods", periods_},
                             {"period-sum", period_sum_},
                             {"period-squares", period_squares_},
                             {"ultimate-gain", ultimate_gain_},
                             {"ultimate-period", ultimate_period_}}};
};

}  // namespace

HAL_COMPONENT(
    Pid, "pid",
    "Proportional/integral/derivative controller with feed-forward, limits and auto-tuning", R"(
    error     = command - feedback, limited to ±maxerror, reduced by deadband
    errorI   += error * period, limited to ±maxerrorI; held while output is limited and error has the sign of what is cut off
    errorD    = slope of command - slope of feedback, limited to ±maxerrorD
    commandD, commandDD, commandDDD = derivatives of command, limited to ±maxcmdD, ±maxcmdDD, ±maxcmdDDD
    output    = bias + error * Pgain + errorI * Igain + errorD * Dgain
              + command * FF0 + commandD * FF1 + commandDD * FF2 + commandDDD * FF3, limited to ±maxoutput

Here `error` is the error after `maxerror` and `deadband`; the pin `error` is the error before both.
The pins `errorI` to `feedbackD` exist with `debug=1` only. `errorI` is the integral before Igain,
in units of `error` times seconds; it is 0 while `enable` is FALSE and during auto-tuning. A limit
of 0 disables it. With `error-previous-target` (the default) the error is computed from the target
of the previous cycle, which the feedback had time to follow. The slopes are `command-deriv` and
`feedback-deriv` if they are linked, else the difference from the previous cycle; `maxerror`,
`deadband` and `error-previous-target` do not change them, so Dgain damps inside the deadband, too.
In the cycle of the falling edge of `index-enable`, a slope computed as a difference keeps its
value. While an input is NaN, `output` is 0 and the integral and the derivatives keep their values.
While a limit is NaN, its last valid value applies, and a fault is raised.

**Differences from LinuxCNC:** the output is bit-identical except in these cases. In the first cycle,
also after a stop of the thread, the slopes are 0 and the error is that of the current command
(LinuxCNC starts from 0, or from before the stop, which kicks FF1 and Dgain). Setting `maxoutput` to
0 ends the saturation (LinuxCNC: `saturated` and the held integral remain). A negative limit or deadband counts as positive (LinuxCNC: the output jumps
between its limits). While an input is NaN the output is 0 (LinuxCNC: NaN). While a limit is NaN its
last valid value applies (LinuxCNC: no limit). Auto-tuning ignores the first two half cycles, before
the oscillation is stable (LinuxCNC averages them in), and leaves the gains as they are, with a
fault, when noise has switched the output: the standard deviation of the periods exceeds 20 % of
their mean (LinuxCNC sets gains that can be 100 times too high). It measures at least 30 half
cycles: fewer of noise can be even by chance.

**Auto-tuning** measures the loop by the relay method and sets the gains by the rules of Ziegler and
Nichols. Hold `command` constant near the middle of the travel; set `tune-effort` to a small value,
then set `enable`, `tune-mode` and `tune-start`. If the loop does not oscillate visibly, increase
`tune-effort`. When `tune-start` becomes FALSE the gains are set (except gains linked to a signal),
and `output` remains at `bias` until `tune-mode` is FALSE. Clearing `enable`, `tune-mode` or
`tune-start` aborts the tuning.

A loop without dead time whose plant is a lag and an integrator, as a position loop on a motor with
a time constant, has no ultimate gain. From rest it oscillates with the fastest period that a thread
can see, 4 of its cycles, and the gains are far too high for an output that has a limit. Nothing
distinguishes it from an integrator alone, whose period is 4 cycles as well and whose gains are
right. Read `ultimate-period` (`debug=1`): below 8 cycles use `identify`, which rejects such an
oscillation and finds a slower one with its parameter `hysteresis`, or set the gains by hand.

    loadrt pid names=pid.x
    addf pid.x.do-pid-calcs servo
    setp pid.x.Pgain 20
    setp pid.x.FF1 1
    setp pid.x.maxoutput 10
    net x-command  => pid.x.command
    net x-feedback => pid.x.feedback
    net x-enable   => pid.x.enable
    net x-velocity <= pid.x.output
)")
