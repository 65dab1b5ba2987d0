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
    interrupted
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
        "stop"};
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
        time_ += dt;
        switch (now_) {
        case Phase::settling: rest(y); break;
        case Phase::step: watch(y, dt); break;
        case Phase::relay: swing(y, dt); break;
        default: break;
        }
        const double given = bias + excitation();
        output = std::isfinite(given) ? given : 0.0;
        phase = static_cast<std::uint32_t>(now_);
        active = running();
    }

private:
    bool running() const noexcept {
        return now_ == Phase::settling || now_ == Phase::step || now_ == Phase::relay;
    }
    double excitation() const noexcept {
        if (now_ == Phase::step) return amplitude;
        if (now_ != Phase::relay) return 0.0;
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
        even_ = 0;
        top_ = y;
        bottom_ = y;
    }
    void enter(Phase next) noexcept {
        now_ = next;
        time_ = 0.0;
        count_ = 0;
        thin_ = 1;
        skip_ = 0;
        quiet_sum_ = quiet_square_ = 0.0;
        quiet_count_ = 0.0;
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
    void rest(double y) noexcept {
        if (time_ > 0.5 * settle_time) {
            quiet_sum_ += y - first_;
            quiet_square_ += (y - first_) * (y - first_);

            quiet_count_ += 1.0;
            if (time_ > 0.75 * settle_time) {
                late_sum_ += y - first_;
                late_count_ += 1.0;
            }
        } else {
            first_ = y;
        }
        if (time_ < settle_time) return;
        const double mean = quiet_count_ > 0.0 ? quiet_sum_ / quiet_count_ : 0.0;
        start_ = first_ + mean;
        noise_ = quiet_count_ > 0.0
                     ? std::sqrt(std::fmax(quiet_square_ / quiet_count_ - mean * mean, 0.0))
                     : 0.0;
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
    void keep(double y) noexcept {
        if (skip_++ % thin_ != 0) return;
        // full: every second one is kept, and from now on half as many are taken
        if (count_ == kept_.size()) {
            for (std::size_t i = 0; 2 * i < count_; ++i) {
                kept_[i] = kept_[2 * i];
            }
            count_ = (count_ + 1) / 2;
            thin_ *= 2;
        }
        if ((skip_ - 1) % thin_ == 0) {
            kept_[count_++] = y;
        }
    }
    void watch(double y, double dt) noexcept {
        keep(y - start_);
        if (time_ >= step_time) {
            evaluate(dt * static_cast<double>(thin_));
        }
    }
    /// Areas of the step response (K. Åström, T. Hägglund, *PID Controllers: Theory, Design, and
    /// Tuning*, 2.4): with the end value y1,
    ///     A0 = integral of y1 - y = y1 (T + L),   A1 = integral of y up to T + L = y1 T / e
    void evaluate(double h) noexcept {
        const std::size_t n = count_;
        const std::size_t tail = std::max<std::size_t>(n / 10, 1);
        if (n < 20 || amplitude == 0.0) return fail(Failure::no_answer);
        double end = 0.0;
        double before = 0.0;
        for (std::size_t i = n - tail; i < n; ++i) {
            end += kept_[i] / static_cast<double>(tail);
        }
        for (std::size_t i = n - 2 * tail; i < n - tail; ++i) {
            before += kept_[i] / static_cast<double>(tail);
        }
        if (!(std::fabs(end) > 4.0 * noise_) || end == 0.0) {
            return fail(end == 0.0 ? Failure::no_answer : Failure::noisy);
        }
        const double uncertain = noise_ * std::sqrt(2.0 / static_cast<double>(tail));
        if (std::fabs(end - before) > 0.01 * std::fabs(end) + 3.0 * uncertain) {
            return fail(Failure::too_long);
        }
        if (!was_settled(end)) return fail(Failure::too_long);
        double a0 = 0.0;
        double a1 = 0.0;
        double at = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            a0 += (end - kept_[i]) * h;
        }
        const double both = a0 / end;
        for (std::size_t i = 0; i < n && at < both; ++i, at += h) {
            a1 += kept_[i] * std::fmin(h, both - at);
        }
        const double t = std::fmax(std::numbers::e * a1 / end, h);
        const double dead = std::fmax(both - t, 0.0);

        const double k = end / amplitude;
        double off = 0.0;
        double all = 0.0;
        for (std::size_t i = 0; i < n; ++i) {
            const double since = static_cast<double>(i) * h - dead,
                         model = since > 0.0 ? -end * std::expm1(-since / t) : 0.0;
            off += (kept_[i] - model) * (kept_[i] - model);

            all += (kept_[i] - end) * (kept_[i] - end);
        }
        gain = k;
        time_constant = t;
        dead_time = dead;
        fit = all > 0.0 ? 1.0 - std::sqrt(off / all) : 0.0;
        propose(k, t, std::fmax(dead, h));
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
    void swing(double y, double dt) noexcept {
        top_ = std::fmax(top_, y);
        bottom_ = std::fmin(bottom_, y);
        const double band = std::fabs(hysteresis);
        const bool up = high_ ? y < setpoint + band : y < setpoint - band;
        if (up && !high_) {
            turned(y, dt);
        } else if (!up && high_ && even_ < periods) {
            downs_[even_] = time_;
        }
        high_ = up;
        if (now_ != Phase::relay) return;
        keep(y - setpoint);
        if (time_ > std::fmax(step_time, 0.0)) {
            fail(Failure::no_oscillation);
        }
    }
    /// Once a period; the first three are left out, four that agree within 10 % make the result.
    void turned(double y, double dt) noexcept {
        const double period = time_ - last_switch_;
        const bool first = last_switch_ < 0.0;
        last_switch_ = time_;
        if (!first && ++swings_ > 3) {
            shortest_ = even_ == 0 ? period : std::fmin(shortest_, period);

            max_ = even_ == 0 ? period : std::fmax(max_, period);
            if (++even_ == periods) {
                if (max_ <= 1.1 * shortest_) return conclude(dt);
                even_ = 0;
            }
        }
        // what is kept begins with this switch
        if (even_ == 0) {
            count_ = 0;
            thin_ = 1;
            skip_ = 0;
            top_ = bottom_ = y;
        }
        ups_[even_] = time_;
    }
    /// The plant is linear, so the first harmonics of answer and output, over all four periods, are
    /// its response at that frequency, whatever the shape of the swing (C. Hang, K. Åström, Q.
    /// Wang, *Relay feedback auto-tuning of process controllers*, J. Process Control 12, 2002).
    /// From there to half a turn of the phase it is taken for an integrator with a dead time, which
    /// is what plants are like in that place.
    void conclude(double dt) noexcept {
        using Complex = std::complex<double>;
        const double h = dt * static_cast<double>(thin_);
        const double begin = ups_[0];
        const double span = time_ - begin;

        const double w = 2.0 * std::numbers::pi * periods / span;
        if (!(0.5 * (top_ - bottom_) > std::fabs(hysteresis))) return fail(Failure::noisy);
        if (span < min_period_cycles * periods * dt) return fail(Failure::noisy);
        const auto turn = [&](double t) noexcept {
            return Complex(std::cos(w * t), -std::sin(w * t));
        };
        Complex in = 0.0;
        Complex out = 0.0;
        Complex at = 1.0;
        const Complex by = turn(h);
        for (std::size_t i = 0; i < count_; ++i) {
            out += kept_[i] * std::fmin(h, span - static_cast<double>(i) * h) * at;
            at = {at.real() * by.real() - at.imag() * by.imag(),
                  at.real() * by.imag() + at.imag() * by.real()};
        }
        for (std::size_t i = 0; i < periods;
             ++i) {  // twice the amplitude while it is up, against the middle of the relay
            in += turn(downs_[i] - begin) - turn(ups_[i] - begin);
        }
        in *= 2.0 * std::fabs(amplitude) * Complex(0.0, 1.0 / w);
        if (!is_swing(2.0 * std::abs(out) / span)) return fail(Failure::noisy);
        const double response = std::abs(out) / std::abs(in);
        const double late = -std::arg(-out / in);

        const double quarter = 0.5 * std::numbers::pi;
        const double farther = std::clamp(quarter / (quarter + late), 0.5, 2.0);
        const double ku = farther / response;
        const double tu = 2.0 * std::numbers::pi / (w * farther);
        if (!(std::isfinite(ku) && ku > 0.0)) return fail(Failure::no_oscillation);
        ultimate_gain = ku;
        ultimate_period = tu;
        // B. Tyreus, W. Luyben, 1992: calmer than Ziegler's and Nichols' rule
        pgain = ku / 3.2;
        igain = pgain / (2.2 * tu);
        dgain = 0.0;
        enter(Phase::done);
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

    static constexpr std::size_t periods = 4;
    static constexpr double min_period_cycles = 8.0;  // noise can switch the relay in each cycle

    Phase now_ = Phase::idle;
    double time_ = 0.0;
    double first_ = 0.0;
    double start_ = 0.0;
    double noise_ = 0.0;
    double quiet_sum_ = 0.0;

    double quiet_square_ = 0.0;
    double quiet_count_ = 0.0;
    double late_sum_ = 0.0;
    double late_count_ = 0.0;
    double drift_ = 0.0;  // at the step, per second
    double drift_noise_ = 0.0;  // its standard deviation
    std::vector<double> kept_;  // the answer, from where it rested
    std::size_t count_ = 0;
    std::size_t thin_ = 1;
    std::size_t skip_ = 0;
    hal::RisingEdge step_edge_;
    hal::RisingEdge relay_edge_;
    bool high_ = false;
    double last_switch_ = -1.0;
    double top_ = 0.0;
    double bottom_ = 0.0;
    int swings_ = 0;
    std::size_t even_ = 0;  // periods so far that are compared
    double shortest_ = 0.0;
    double max_ = 0.0;  // of them
    std::array<double, periods> ups_{}, downs_{};  // when the output was switched
    hal::Retained retained_{*this,
                            {{"now", now_},
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
                             {"thin", thin_},
                             {"skip", skip_},
                             {"step-was", step_edge_},
                             {"relay-was", relay_edge_},
                             {"high", high_},
                             {"last-switch", last_switch_},
                             {"top", top_},
                             {"bottom", bottom_},
                             {"swings", swings_},
                             {"even", even_},
                             {"shortest", shortest_},
                             {"longest", max_},
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
