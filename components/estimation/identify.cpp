// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "hal/component.hpp"
#include "hal/edge.hpp"
#include "hal/retained.hpp"

namespace {

enum class Phase : std::uint32_t { idle, settling, step, relay, done, failed };
enum class Failure : std::uint32_t {
    none,
    not_a_number,
    no_answer,
    noisy,
    too_long,
    no_oscillation,
    interrupted,
    invalid_setting
};

struct Identify : hal::Component {
    explicit Identify(const hal_host* host)
        : Component(host),
          samples(*this, "samples", 4000, "samples kept of a step; a longer step is decimated",
                  {.min = 100, .max = 1'000'000}) {
        kept_.assign(static_cast<std::size_t>(samples), 0.0);
    }

    hal::Argument samples;
    hal::In<bool> step{*this, "step", "a rising edge starts a step experiment"};
    hal::In<bool> relay{*this, "relay", "a rising edge starts a relay experiment"};
    hal::In<bool> cancel{*this, "cancel", "TRUE ends an experiment and sets output to bias"};
    hal::In<double> value{*this, "value", "measured output of the plant"};
    hal::In<double> setpoint{*this, "setpoint", "relay: centre of the oscillation of value"};
    hal::In<double> bias{*this, "bias", "idle value of output, and centre of the relay"};
    hal::In<double> amplitude{
        *this, "amplitude", "height of the step; amplitude of the relay", {.initial = 1.0}};
    hal::In<double> hysteresis{*this, "hysteresis",
                               "relay: hysteresis; must exceed the noise, else failure 3"};
    hal::In<double> settle_time{*this,
                                "settle-time",
                                "time at bias before a step, for the plant to settle",
                                {.initial = 1.0, .unit = "s"}};
    hal::In<double> step_time{*this,
                              "step-time",
                              "duration of a step; the plant must settle within it",
                              {.initial = 10.0, .unit = "s"}};
    hal::In<double> closed_loop{
        *this,
        "closed-loop-time",
        "target time constant of the closed loop for the proposed gains; 0: the dead time",
        {.unit = "s"}};

    hal::Out<double> output{*this, "output", "input of the plant", {.safe = 0.0, .finite = true}};
    hal::Out<std::uint32_t> phase{*this, "phase",
                                  "0 idle, 1 settling, 2 step, 3 relay, 4 done, 5 failed"};
    hal::Out<std::uint32_t> failure{
        *this, "failure",
        "reason of a failure: 1 value is NaN or infinite, 2 no response, 3 response below the "
        "noise, or relay: switched by it, 4 not settled, 5 no oscillation, 6 interrupted by a "
        "stop, 7 a setting is NaN or infinite"};
    hal::Out<bool> active{*this, "active", "TRUE during an experiment", {.safe = false}};
    hal::Out<double> gain{*this, "gain", "K of K e^(-L s) / (T s + 1)"};
    hal::Out<double> time_constant{
        *this, "time-constant", "T of K e^(-L s) / (T s + 1)", {.unit = "s"}};
    hal::Out<double> dead_time{*this, "dead-time", "L of K e^(-L s) / (T s + 1)", {.unit = "s"}};
    hal::Out<double> fit{*this, "fit",
                         "step: part of the response explained by the model, at most 1"};
    hal::Out<double> ultimate_gain{*this, "ultimate-gain",
                                   "relay: gain of the loop at its stability limit"};
    hal::Out<double> ultimate_period{
        *this, "ultimate-period", "relay: period of the oscillation at that gain", {.unit = "s"}};
    hal::Out<double> pgain{*this, "Pgain", "proposed for pid"};
    hal::Out<double> igain{*this, "Igain", "proposed for pid"};
    hal::Out<double> dgain{*this, "Dgain", "proposed for pid"};

    hal::Function run{*this, "update", &Identify::update, "runs one period of the experiment"};

    /// Follows the commands, runs one period of the experiment, and sets the outputs.
    void update(hal::Cycle cycle) noexcept {
        const double dt = cycle.seconds();
        const double y = value;
        if (running() && !active) {  // the outputs had their safe values meanwhile
            fail(Failure::interrupted);
        }
        follow_commands(y);
        if (running() && !std::isfinite(y)) {
            fail(Failure::not_a_number);
        }
        if (running() && !has_finite_settings()) {
            fail(Failure::invalid_setting);
        }
        time_ += dt;
        switch (state_) {
        case Phase::settling: measure_rest(y); break;
        case Phase::step: record_step(y, dt); break;
        case Phase::relay: run_relay(y, dt); break;
        default: break;
        }
        const double given = bias + excitation();
        output = std::isfinite(given) ? given : 0.0;
        phase = static_cast<std::uint32_t>(state_);
        active = running();
    }

private:
    bool running() const noexcept {
        return state_ == Phase::settling || state_ == Phase::step || state_ == Phase::relay;
    }
    /// An experiment with other ones might never end.
    bool has_finite_settings() const noexcept {
        const std::array settings{bias.get(),      amplitude.get(), settle_time.get(),
                                  step_time.get(), setpoint.get(),  hysteresis.get()};
        return std::ranges::all_of(settings, [](double one) { return std::isfinite(one); });
    }
    double excitation() const noexcept {
        if (state_ == Phase::step) return amplitude;
        if (state_ != Phase::relay) return 0.0;
        return high_ ? amplitude.get() : -amplitude;
    }

    /// Begins or ends an experiment: cancel takes precedence over step, and step over relay.
    void follow_commands(double y) noexcept {
        const bool begins_step = step_edge_.rises(step);
        const bool begins_relay = relay_edge_.rises(relay);
        if (cancel) {
            enter(Phase::idle);
        } else if (begins_step) {
            enter(Phase::settling);
        } else if (begins_relay) {
            begin_relay(y);
        }
    }
    void begin_relay(double y) noexcept {
        enter(Phase::relay);
        high_ = y < setpoint;
        last_switch_ = -1.0;
        swings_ = 0;
        compared_ = 0;
        top_ = y;
        bottom_ = y;
    }
    void enter(Phase next) noexcept {
        state_ = next;
        time_ = 0.0;
        forget_samples();
        quiet_sum_ = quiet_square_ = quiet_count_ = 0.0;
        late_sum_ = late_count_ = 0.0;
        if (next != Phase::done && next != Phase::failed) {
            failure = 0;
        }
    }
    void fail(Failure why) noexcept {
        enter(Phase::failed);
        failure = static_cast<std::uint32_t>(why);
    }
    /// The second half of the settling time gives the steady state and the noise; its two halves
    /// give the drift.
    void measure_rest(double y) noexcept {
        if (time_ > 0.5 * settle_time) {
            const double deviation = y - first_;
            quiet_sum_ += deviation;
            quiet_square_ += deviation * deviation;
            quiet_count_ += 1.0;
            if (time_ > 0.75 * settle_time) {
                late_sum_ += deviation;
                late_count_ += 1.0;
            }
        } else {
            first_ = y;
        }
        if (time_ < settle_time) return;
        start_ = first_;
        noise_ = 0.0;
        if (quiet_count_ > 0.0) {
            const double mean = quiet_sum_ / quiet_count_;
            const double variance = quiet_square_ / quiet_count_ - mean * mean;
            start_ = first_ + mean;
            noise_ = std::sqrt(std::fmax(variance, 0.0));
        }
        find_drift();
        enter(Phase::step);
    }
    /// How fast the value still moves at the step, and the uncertainty of that by the noise.
    void find_drift() noexcept {
        const double early_count = quiet_count_ - late_count_;
        drift_ = drift_noise_ = 0.0;
        if (!(early_count > 0.0 && late_count_ > 0.0 && settle_time > 0.0)) return;
        const double quarter = 0.25 * settle_time;
        const double early = (quiet_sum_ - late_sum_) / early_count;
        drift_ = (late_sum_ / late_count_ - early) / quarter;
        drift_noise_ = noise_ * std::sqrt(1.0 / early_count + 1.0 / late_count_) / quarter;
    }
    /// Returns whether the plant had settled before the step, whose response ended at `end`. With a
    /// time constant of at most a quarter of the step, which the end of the response has shown, a
    /// drift goes on by at most that many seconds of it.
    bool was_settled(double end) const noexcept {
        const double longest = 0.25 * step_time;
        return (std::fabs(drift_) - 3.0 * drift_noise_) * longest <= 0.02 * std::fabs(end);
    }
    /// Keeps one of `decimation_` samples. When the memory is full, every second one of it remains
    /// and the decimation doubles.
    void keep(double y) noexcept {
        const std::size_t sample = samples_seen_++;
        if (sample % decimation_ != 0) return;
        if (count_ == kept_.size()) {
            for (std::size_t i = 0; 2 * i < count_; ++i) {
                kept_[i] = kept_[2 * i];
            }
            count_ = (count_ + 1) / 2;
            decimation_ *= 2;
        }
        if (sample % decimation_ == 0) {
            kept_[count_++] = y;
        }
    }
    void forget_samples() noexcept {
        count_ = 0;
        decimation_ = 1;
        samples_seen_ = 0;
    }
    void record_step(double y, double dt) noexcept {
        keep(y - start_);
        if (time_ >= step_time) {
            evaluate_step(dt * static_cast<double>(decimation_));
        }
    }
    /// The result of a step experiment: a first-order model, its fit, and the gains proposed for
    /// it. `h` is the time between kept samples.
    void evaluate_step(double h) noexcept {
        if (count_ < min_step_samples || amplitude == 0.0) return fail(Failure::no_answer);
        const std::size_t tenth = count_ / 10;
        const double end = mean(count_ - tenth, count_);
        const double end_before = mean(count_ - 2 * tenth, count_ - tenth);
        if (end == 0.0) return fail(Failure::no_answer);
        if (!(std::fabs(end) > 4.0 * noise_)) return fail(Failure::noisy);
        const double noise_of_means = noise_ * std::sqrt(2.0 / static_cast<double>(tenth));
        if (std::fabs(end - end_before) > 0.01 * std::fabs(end) + 3.0 * noise_of_means) {
            return fail(Failure::too_long);
        }
        if (!was_settled(end)) return fail(Failure::too_long);
        const FirstOrder model = first_order_by_areas(end, h);
        gain = model.end / amplitude;
        time_constant = model.time_constant;
        dead_time = model.dead_time;
        fit = fit_of(model, h);
        propose(model.end / amplitude, model.time_constant, std::fmax(model.dead_time, h));
    }
    double mean(std::size_t begin, std::size_t end) const noexcept {
        const auto count = static_cast<double>(end - begin);
        double mean = 0.0;
        for (std::size_t i = begin; i < end; ++i) {
            mean += kept_[i] / count;
        }
        return mean;
    }

    /// A step response: end (1 - e^(-(t - dead_time) / time_constant)) from dead_time on.
    struct FirstOrder {
        double end;
        double time_constant;
        double dead_time;
        double at(double time) const noexcept {
            const double since = time - dead_time;
            return since > 0.0 ? -end * std::expm1(-since / time_constant) : 0.0;
        }
    };
    /// Areas of the step response (K. Åström, T. Hägglund, *PID Controllers: Theory, Design, and
    /// Tuning*, 2.4): with the end value y1,
    ///     A0 = integral of y1 - y = y1 (T + L),   A1 = integral of y up to T + L = y1 T / e
    /// T + L is the average residence time.
    FirstOrder first_order_by_areas(double end, double h) const noexcept {
        double a0 = 0.0;
        for (std::size_t i = 0; i < count_; ++i) {
            a0 += (end - kept_[i]) * h;
        }
        const double residence_time = a0 / end;
        double a1 = 0.0;
        double time = 0.0;
        for (std::size_t i = 0; i < count_ && time < residence_time; ++i) {
            a1 += kept_[i] * std::fmin(h, residence_time - time);
            time += h;
        }
        const double t = std::fmax(std::numbers::e * a1 / end, h);
        return {end, t, std::fmax(residence_time - t, 0.0)};
    }
    /// The part of the response that the model explains, at most 1.
    double fit_of(const FirstOrder& model, double h) const noexcept {
        double residual_square = 0.0;
        double total_square = 0.0;
        for (std::size_t i = 0; i < count_; ++i) {
            const double residual = kept_[i] - model.at(static_cast<double>(i) * h);
            const double from_end = kept_[i] - model.end;
            residual_square += residual * residual;
            total_square += from_end * from_end;
        }
        return total_square > 0.0 ? 1.0 - std::sqrt(residual_square / total_square) : 0.0;
    }
    /// S. Skogestad, *Simple analytic rules for model reduction and PID controller tuning*, J.
    /// Process Control 13, 2003 (SIMC).
    void propose(double k, double t, double dead) noexcept {
        const double wanted = closed_loop > 0.0 ? closed_loop.get() : dead;
        const double p = t / (k * (wanted + dead));
        const double integral = std::fmin(t, 4.0 * (wanted + dead));
        pgain = std::isfinite(p) ? p : 0.0;
        igain = std::isfinite(p / integral) ? p / integral : 0.0;
        dgain = 0.0;
        enter(Phase::done);
    }
    /// The relay makes the loop oscillate near the frequency where the plant shifts the phase by
    /// 180 degrees (K. Åström, T. Hägglund, *Automatic Tuning of Simple Regulators with
    /// Specifications on Phase and Amplitude Margins*, Automatica 20, 1984).
    void run_relay(double y, double dt) noexcept {
        top_ = std::fmax(top_, y);
        bottom_ = std::fmin(bottom_, y);
        const double band = std::fabs(hysteresis);
        const bool high = high_ ? y < setpoint + band : y < setpoint - band;
        if (high && !high_) {
            finish_period(y, dt);
        } else if (!high && high_ && compared_ < periods) {
            downs_[compared_] = time_;
        }
        high_ = high;
        if (state_ != Phase::relay) return;
        keep(y - setpoint);
        if (time_ > std::fmax(step_time, 0.0)) {
            fail(Failure::no_oscillation);
        }
    }
    /// Called when the output is switched up, once a period. The first periods are left out;
    /// `periods` of them that agree within 10 % make the result.
    void finish_period(double y, double dt) noexcept {
        const bool has_begun = last_switch_ >= 0.0;
        const double period = time_ - last_switch_;
        last_switch_ = time_;
        if (has_begun && ++swings_ > transient_periods) {
            compare(period);
            if (compared_ == periods) {
                if (longest_ <= 1.1 * shortest_) return evaluate_relay(dt);
                compared_ = 0;
            }
        }
        if (compared_ == 0) {  // what is kept begins with this switch
            forget_samples();
            top_ = bottom_ = y;
        }
        ups_[compared_] = time_;
    }
    void compare(double period) noexcept {
        if (compared_ == 0) {
            shortest_ = period;
            longest_ = period;
        }
        shortest_ = std::fmin(shortest_, period);
        longest_ = std::fmax(longest_, period);
        ++compared_;
    }
    /// The plant is linear, so the first harmonics of answer and output, over all four periods, are
    /// its response at that frequency, whatever the shape of the swing (C. Hang, K. Åström, Q.
    /// Wang, *Relay feedback auto-tuning of process controllers*, J. Process Control 12, 2002).
    /// From there to half a turn of the phase it is taken for an integrator with a dead time, which
    /// is what plants are like in that place.
    void evaluate_relay(double dt) noexcept {
        const double span = time_ - ups_[0];
        if (!(0.5 * (top_ - bottom_) > std::fabs(hysteresis))) return fail(Failure::noisy);
        if (span < min_period_cycles * periods * dt) return fail(Failure::noisy);
        const double w = 2.0 * std::numbers::pi * periods / span;
        const Complex response = response_harmonic(w, dt * static_cast<double>(decimation_), span);
        const Complex excitation = excitation_harmonic(w);
        if (!is_swing(2.0 * std::abs(response) / span)) return fail(Failure::noisy);
        const double gain_at_w = std::abs(response) / std::abs(excitation);
        const double lag_beyond_half_turn = -std::arg(-response / excitation);

        const double quarter_turn = 0.5 * std::numbers::pi;
        const double ultimate_to_w =
            std::clamp(quarter_turn / (quarter_turn + lag_beyond_half_turn), 0.5, 2.0);
        const double ku = ultimate_to_w / gain_at_w;
        const double tu = 2.0 * std::numbers::pi / (w * ultimate_to_w);
        if (!(std::isfinite(ku) && ku > 0.0)) return fail(Failure::no_oscillation);
        ultimate_gain = ku;
        ultimate_period = tu;
        // B. Tyreus, W. Luyben, 1992: calmer than Ziegler's and Nichols' rule
        pgain = ku / 3.2;
        igain = pgain / (2.2 * tu);
        dgain = 0.0;
        enter(Phase::done);
    }

    using Complex = std::complex<double>;
    /// e^(-j angle)
    static Complex phasor(double angle) noexcept {
        return Complex(std::cos(angle), -std::sin(angle));
    }
    /// The integral of the kept samples, h apart, times e^(-j w t) over `span`.
    Complex response_harmonic(double w, double h, double span) const noexcept {
        Complex sum = 0.0;
        Complex turned = 1.0;
        const Complex turn = phasor(w * h);
        for (std::size_t i = 0; i < count_; ++i) {
            sum += kept_[i] * std::fmin(h, span - static_cast<double>(i) * h) * turned;
            turned = {turned.real() * turn.real() - turned.imag() * turn.imag(),
                      turned.real() * turn.imag() + turned.imag() * turn.real()};
        }
        return sum;
    }
    /// The same integral of the output, from its switching times: twice the amplitude while it is
    /// up, against the middle of the relay.
    Complex excitation_harmonic(double w) const noexcept {
        Complex sum = 0.0;
        for (std::size_t i = 0; i < periods; ++i) {
            sum += phasor(w * (downs_[i] - ups_[0])) - phasor(w * (ups_[i] - ups_[0]));
        }
        return sum * (2.0 * std::fabs(amplitude) * Complex(0.0, 1.0 / w));
    }

    /// Returns whether a harmonic of this amplitude is most of what is kept. Noise that switches the
    /// relay is not: most of it has other frequencies.
    bool is_swing(double harmonic) const noexcept {
        const auto n = static_cast<double>(count_);
        double sum = 0.0;
        double square = 0.0;
        for (std::size_t i = 0; i < count_; ++i) {
            sum += kept_[i];
            square += kept_[i] * kept_[i];
        }
        const double variance = square / n - sum / n * (sum / n);
        return 0.5 * harmonic * harmonic > 0.75 * variance;
    }

    static constexpr std::size_t min_step_samples = 20;
    static constexpr int transient_periods = 3;
    static constexpr std::size_t periods = 4;
    static constexpr double min_period_cycles = 8.0;  // noise can switch the relay in each cycle

    Phase state_ = Phase::idle;
    double time_ = 0.0;  // in this state, s
    double first_ = 0.0;  // value that the sums below are relative to
    double start_ = 0.0;  // mean of the value at rest
    double noise_ = 0.0;  // standard deviation of the value at rest
    double quiet_sum_ = 0.0;  // second half of the settling time
    double quiet_square_ = 0.0;
    double quiet_count_ = 0.0;
    double late_sum_ = 0.0;  // its last quarter
    double late_count_ = 0.0;
    double drift_ = 0.0;  // at the step, per second
    double drift_noise_ = 0.0;  // its standard deviation
    std::vector<double> kept_;  // the answer, from where it rested
    std::size_t count_ = 0;
    std::size_t decimation_ = 1;
    std::size_t samples_seen_ = 0;  // kept or not
    hal::RisingEdge step_edge_;
    hal::RisingEdge relay_edge_;
    bool high_ = false;  // the relay is at bias + amplitude
    double last_switch_ = -1.0;  // to high; negative: none yet
    double top_ = 0.0;
    double bottom_ = 0.0;
    int swings_ = 0;  // whole periods
    std::size_t compared_ = 0;  // periods since the transient, 0..periods
    double shortest_ = 0.0;
    double longest_ = 0.0;  // of the compared periods
    std::array<double, periods> ups_{}, downs_{};  // when the output was switched
    hal::Retained retained_{*this,
                            {{"now", state_},
                             {"time", time_},
                             {"first", first_},
                             {"start", start_},
                             {"noise", noise_},
                             {"quiet-sum", quiet_sum_},
                             {"quiet-square", quiet_square_},
                             {"quiet-count", quiet_count_},
                             {"late-sum", late_sum_},
                             {"late-count", late_count_},
                             {"drift", drift_},
                             {"drift-noise", drift_noise_},
                             {"kept", kept_},
                             {"count", count_},
                             {"thin", decimation_},
                             {"skip", samples_seen_},
                             {"step-was", step_edge_},
                             {"relay-was", relay_edge_},
                             {"high", high_},
                             {"last-switch", last_switch_},
                             {"top", top_},
                             {"bottom", bottom_},
                             {"swings", swings_},
                             {"even", compared_},
                             {"shortest", shortest_},
                             {"longest", longest_},
                             {"ups", ups_},
                             {"downs", downs_}}};
};

}  // namespace

HAL_COMPONENT(
    Identify, "identify",
    "Identifies a plant's gain, time constant and dead time by experiment, and proposes PID gains",
    R"(
The plant is modelled as K e^(-L s) / (T s + 1), first order with dead time.

**Step.** The output remains at `bias` for `settle-time`, then steps by `amplitude` for `step-time`. K, T and L follow from the areas under the response,
which are insensitive to noise; `fit` is the quality of the model. The plant must have settled before the step, and within it: failure 4 is a value that drifted at
the step by more than 2 % of the response within a quarter of `step-time`, or that changed by more than 1 % between the last two tenths of it, beyond the noise. The proposed gains follow Skogestad's SIMC rule: a PI with the closed-loop time constant
`closed-loop-time`, or the dead time.

**Relay.** The output switches between bias + amplitude and bias - amplitude whenever `value` passes `setpoint`; the plant oscillates, four equal periods
give `ultimate-gain` and `ultimate-period`, and the Tyreus-Luyben rule the proposed gains. The first harmonics of output and response are compared, not their
amplitudes, so the error of the gain is below 3 %, or 6 % for a plant with dominant dead time (4 d / (pi a) has an error of 18 % for K = 2, T = 0.5 s,
L = 0.1 s). The experiment fails if there is no oscillation within `step-time`. Noise that exceeds `hysteresis` switches the relay, too: failure 3 is an
oscillation whose period is below 8 cycles of the thread, or of whose power the first harmonic has less than three quarters. Then increase `hysteresis` or
`amplitude`.

A setting that is NaN or infinite ends an experiment with failure 7, because it might never end.

An experiment does not survive a stop of the machine: `output` is 0 then, and with the next start the experiment has failed.

The component changes only `output`: connect it to the plant by a mux2, and set the gains of the controller yourself. `failure` is the reason of a failure.

    loadrt identify names=oven
    addf oven.update servo
    setp oven.amplitude 20
    setp oven.step-time 600
    net heat        <= oven.output
    net temperature => oven.value
    setp oven.step TRUE
)")
