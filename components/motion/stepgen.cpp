// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "hal/component.hpp"
#include "hal/corrected.hpp"
#include "hal/function_monitor.hpp"
#include "hal/interruption.hpp"
#include "hal/last_valid.hpp"
#include "hal/lasting_fault.hpp"
#include "hal/limit.hpp"
#include "hal/queue.hpp"
#include "hal/retained.hpp"

namespace {

/// The command of `update-freq` for `make-pulses`.
struct Order {
    bool on = false;
    double rate = 0.0;          // steps per second, signed
    double slope = 0.0;  // acceleration towards rate, steps per second squared; 0: immediate
    std::int64_t step_ns = 0;
    std::int64_t space_ns = 0;
    std::int64_t hold_ns = 0;
    std::int64_t setup_ns = 0;
};

/// The outputs of a motor with several phases: bit 0 is phase A. Full steps drive one phase or two
/// neighbours, half steps alternate; bipolar ones are two bridges, A-B and C-D, that carry current
/// where their two outputs differ.
constexpr int max_states = 18;

struct Sequence {
    int phases;
    int length;
    std::array<std::uint8_t, max_states> states;
};
constexpr int first_sequence = 2;
constexpr int user_type = 15;
constexpr std::array<Sequence, 13> sequences{{
    // 2 quadrature
    {2, 4, {0b01, 0b11, 0b10, 0b00}},
    // 3 three phases, full step
    {3, 3, {0b001, 0b010, 0b100}},
    // 4 three phases, half step
    {3, 6, {0b001, 0b011, 0b010, 0b110, 0b100, 0b101}},
    // 5 unipolar, one phase on
    {4, 4, {0b0001, 0b0010, 0b0100, 0b1000}},
    // 6 unipolar, two phases on
    {4, 4, {0b0011, 0b0110, 0b1100, 0b1001}},
    // 7 bipolar, one bridge on
    {4, 4, {0b0001, 0b0111, 0b1110, 0b1000}},
    // 8 bipolar, both bridges on
    {4, 4, {0b0101, 0b0110, 0b1010, 0b1001}},
    // 9 unipolar, half step
    {4, 8, {0b0001, 0b0011, 0b0010, 0b0110, 0b0100, 0b1100, 0b1000, 0b1001}},
    // 10 bipolar, half step
    {4, 8, {0b0001, 0b0101, 0b0111, 0b0110, 0b1110, 0b1010, 0b1000, 0b1001}},
    // 11 five phases, one on
    {5, 5, {0b00001, 0b00010, 0b00100, 0b01000, 0b10000}},
    // 12 five phases, two on
    {5, 5, {0b00011, 0b00110, 0b01100, 0b11000, 0b10001}},
    // 13 one or two
    {5,
     10,
     {0b00001, 0b00011, 0b00010, 0b00110, 0b00100, 0b01100, 0b01000, 0b11000, 0b10000, 0b10001}},
    // 14 two or three
    {5,
     10,
     {0b00011, 0b00111, 0b00110, 0b01110, 0b01100, 0b11100, 0b11000, 0b11001, 0b10001, 0b10011}},
}};

struct Stepgen : hal::Component {
    enum Type { step_dir, up_down };

    hal::Argument type{*this,
                       "step_type",
                       0,
                       "waveform, 0..15; one number per instance",
                       {.per_instance = true, .min = 0, .max = user_type}};
    hal::TextArgument control{*this,
                              "ctrl_type",
                              "p",
                              "p: position-cmd, v: velocity-cmd; one letter per instance",
                              {.per_instance = true}};
    hal::TextArgument user{
        *this, "user_step_type", "",
        "states of step type 15: at most 18 numbers of up to 5 bits, 0x1,0x2,0x4"};

    hal::Function make{*this,
                       "make-pulses",
                       &Stepgen::make_pulses,
                       "generates the waveforms; belongs in the fastest thread",
                       {.shared = true}};
    std::optional<hal::Out<bool>> first, second;  // step and dir, or up and down
    hal::Out<std::int32_t> raw_counts{*this, make, "rawcounts", "steps made since the start"};

    hal::Function capture{*this,
                          "capture-position",
                          &Stepgen::capture_position,
                          "updates the position feedback; belongs before the controller",
                          {.shared = true}};
    hal::Out<std::int32_t> counts{*this, capture, "counts", "steps made since the start"};
    hal::Out<double> position_fb{*this, capture, "position-fb",
                                 "position in length units, with sub-step resolution"};

    hal::Function run{*this,
                      "update-freq",
                      &Stepgen::update_freq,
                      "reads the command; belongs in the servo thread, after the controller",
                      {.shared = true}};
    hal::In<bool> enable{*this, run, "enable", "FALSE stops the generator"};
    std::optional<hal::In<double>> position_cmd, velocity_cmd;
    hal::CorrectedParam<double> position_scale{
        *this, run, "position-scale", "steps per length unit; 0 is set to 1", {.initial = 1.0}};
    hal::OptionalCorrectedLimitParam max_velocity{
        *this, run, "maxvel",
        "limit on the speed in length units per second; 0: limited by the pulse timing only"};
    hal::OptionalCorrectedLimitParam max_acceleration{
        *this, run, "maxaccel",
        "limit on the acceleration in length units per second squared; 0: no limit"};
    hal::Out<double> frequency{*this, run, "frequency", "current step rate", {.unit = "Hz"}};
    hal::CorrectedParam<std::uint32_t> step_length{
        *this,
        run,
        "steplen",
        "length of a step pulse, or minimum time in a state",
        {.initial = 1, .unit = "ns"}};
    std::optional<hal::CorrectedParam<std::uint32_t>> step_space, dir_hold, dir_setup, dir_delay;

    explicit Stepgen(const hal_host* host) : Component(host) {
        if (control.get() != "p" && control.get() != "v") {
            throw hal::ArgumentError("ctrl_type",
                                     "ctrl_type=" + control.get() + " is neither p nor v");
        }
        const hal::PinOptions<bool> off{.safe = false};
        const hal::PinOptions<std::uint32_t> one{.initial = 1, .unit = "ns"};
        if (type == step_dir) {
            first.emplace(*this, make, "step", "one pulse per step", off);
            second.emplace(*this, make, "dir", "TRUE for steps backwards");
        } else if (type == up_down) {
            first.emplace(*this, make, "up", "one pulse per step forwards", off);
            second.emplace(*this, make, "down", "one pulse per step backwards", off);
        } else {
            sequence_ = type == user_type
                            ? user_sequence()
                            : sequences[static_cast<std::size_t>(type - first_sequence)];
            static constexpr std::array names{"phase-A", "phase-B", "phase-C", "phase-D",
                                              "phase-E"};
            for (int i = 0; i < sequence_.phases; ++i) {
                phase_[static_cast<std::size_t>(i)].emplace(
                    *this, make, names[static_cast<std::size_t>(i)], "phase of the motor", off);
            }
        }
        if (type <= up_down) {
            step_space.emplace(*this, run, "stepspace",
                               "minimum time between step pulses; 0: a pulse in every period", one);
        }
        if (type == step_dir) {
            dir_hold.emplace(*this, run, "dirhold",
                             "minimum time from the end of a pulse to a change of dir", one);
            dir_setup.emplace(*this, run, "dirsetup",
                              "minimum time from a change of dir to the next pulse", one);
        } else {
            dir_delay.emplace(*this, run, "dirdelay",
                              "minimum time between steps in opposite directions", one);
        }
        if (control.get() == "p") {
            position_cmd.emplace(*this, run, "position-cmd", "commanded position in length units");
        } else {
            velocity_cmd.emplace(*this, run, "velocity-cmd",
                                 "commanded speed in length units per second");
        }
    }

    void make_pulses(hal::Cycle cycle) noexcept {
        const std::int64_t tick_ns = cycle.period_ns();
        tick_ns_.store(tick_ns, std::memory_order_relaxed);
        Order wanted = orders_.get();
        if (is_abandoned(tick_ns)) {
            wanted.on = false;
            wanted.rate = 0.0;
            wanted.slope = 0.0;
        }
        if (pulses_interrupted_.accept()) {
            rate_ = 0.0;
        }
        const double before = rate_;
        const double change = wanted.slope * cycle.seconds();
        rate_ =
            change > 0.0 ? std::clamp(wanted.rate, before - change, before + change) : wanted.rate;
        position_ += (change > 0.0 ? 0.5 * (before + rate_) : rate_) * cycle.seconds();
        for (std::int64_t* timer : {&pulse_ns_, &space_ns_, &hold_ns_, &setup_ns_}) {
            *timer = std::max<std::int64_t>(0, *timer - tick_ns);
        }

        if (pulse_ns_ == 0 && high_) {  // the pulse ends
            high_ = false;
            space_ns_ = wanted.space_ns;
            hold_ns_ = wanted.hold_ns;
        }
        const std::int64_t due = static_cast<std::int64_t>(std::floor(position_ + 0.5)) - made_;
        if (due != 0 && !high_ && wanted.on) {
            advance(due > 0 ? 1 : -1, wanted);
        }

        show();
        raw_counts = static_cast<std::int32_t>(made_);
        made_out_.store(made_, std::memory_order_relaxed);
        position_out_.store(position_, std::memory_order_relaxed);
    }

    void capture_position(hal::Cycle) noexcept {
        counts = static_cast<std::int32_t>(made_out_.load(std::memory_order_relaxed));
        position_fb = position_out_.load(std::memory_order_relaxed) / scale();
    }

    /// Computes the rate of the steps from the commanded position or velocity, and orders it from
    /// make-pulses together with the timing of the pulses. While disabled the rate is 0.
    void update_freq(hal::Cycle cycle) noexcept {
        updates_.ran(cycle.period_ns());
        const bool was_abandoned = was_abandoned_.exchange(false, std::memory_order_relaxed);
        if (updates_interrupted_.accept() || was_abandoned) {
            frequency = 0.0;
            if (position_cmd) {
                last_command_ = *position_cmd * scale();
            }
        }
        if (std::fabs(position_scale) < 1e-20) {
            position_scale.correct(1.0);
        }
        scale_.store(valid_scale_.follow(position_scale), std::memory_order_relaxed);
        const std::int64_t known_ns = tick_ns_.load(std::memory_order_relaxed),
                           tick_ns = known_ns > 0 ? known_ns : cycle.period_ns();
        if (known_ns > 0) {
            correct_times(known_ns);
        }
        if (enable) {
            correct_limits(highest_rate(tick_ns), cycle.seconds());
        }
        const double wanted =
            enable ? limited(command(cycle.seconds()), tick_ns, cycle.seconds()) : 0.0;
        if (!enable && position_cmd) {
            last_command_ = *position_cmd * scale();
        }
        frequency = wanted;
        Order next;
        next.on = enable;
        next.rate = wanted;
        next.slope = enable ? acceleration() : 0.0;
        next.step_ns = step_length;
        if (step_space) {
            next.space_ns = *step_space;
        }
        if (dir_hold) {
            next.hold_ns = *dir_hold;
        }
        if (dir_setup) {
            next.setup_ns = *dir_setup;
        }
        if (dir_delay) {
            next.hold_ns = *dir_delay;
        }
        orders_.put(next);
    }

private:
    /// Returns true while update-freq, which reads enable, no longer runs; records the fault. Only
    /// for make-pulses. [realtime]
    bool is_abandoned(std::int64_t tick_ns) noexcept {
        const bool abandoned = updates_.is_missing(tick_ns) && updates_.has_run();
        if (abandoned && !abandoned_.lasts()) {
            was_abandoned_.store(true, std::memory_order_relaxed);
            abandoned_.begin(faults_, this, abandoned_text_.c_str());
        } else if (!abandoned && abandoned_.lasts()) {
            abandoned_.end(faults_, this);
        }
        return abandoned;
    }

    /// Returns the commanded speed in steps/s at the end of this period, before limits. For a
    /// position command: the speed of the command plus a correction for the distance e. With an
    /// acceleration a the speed changes linearly over the period T; from v to w it covers (v + w) T
    /// / 2, and the remaining distance must be enough to brake from w:
    ///     e - (v + w) T / 2 = w^2 / 2a,  so  w = sqrt((a T / 2)^2 + 2 a (e - v T / 2)) - a T / 2
    double command(double dt) noexcept {
        if (velocity_cmd) return *velocity_cmd * scale();
        const double target = *position_cmd * scale();
        const double own = (target - last_command_) / dt;
        last_command_ = target;
        const double distance = target - position_out_.load(std::memory_order_relaxed);
        const double a = acceleration();
        if (!(a > 0.0)) return own + distance / dt;
        const double half = 0.5 * a * dt;
        const double left = distance - 0.5 * (frequency - own) * dt;
        const double closing = std::sqrt(half * half + 2.0 * a * std::fabs(left)) - half;
        return own + std::copysign(std::min(closing, std::fabs(distance) / dt), left);
    }

    /// Returns `time_ns` rounded up to whole periods of make-pulses.
    static std::uint32_t whole_periods(std::uint32_t time_ns, std::int64_t period_ns) noexcept {
        const std::int64_t periods = (std::int64_t{time_ns} + period_ns - 1) / period_ns;
        return static_cast<std::uint32_t>(std::min(periods, std::int64_t{UINT32_MAX} / period_ns) *
                                          period_ns);
    }

    void correct_times(std::int64_t period_ns) noexcept {
        step_length.correct(whole_periods(std::max(step_length.get(), 1u), period_ns));
        if (type == step_dir && *dir_hold == 0 && *dir_setup == 0) {
            dir_hold->correct(1);
        }
        if (type == up_down && *dir_delay == 0) {
            dir_delay->correct(1);
        }
        for (auto* time : {&step_space, &dir_hold, &dir_setup, &dir_delay}) {
            if (*time) {
                (*time)->correct(whole_periods(**time, period_ns));
            }
        }
    }

    /// Sets negative limits to 0, and limits that have no effect to the highest one that has.
    void correct_limits(double highest, double dt) noexcept {
        const double steps = std::fabs(scale());
        if (max_velocity < 0.0) {
            max_velocity.correct(0.0);
        }
        if (max_velocity * steps > highest) {
            max_velocity.correct(highest / steps);
        }
        if (max_velocity > 0.0) {
            highest = std::min(highest, max_velocity * steps);
        }
        if (max_acceleration < 0.0) {
            max_acceleration.correct(0.0);
        }
        if (max_acceleration * steps > highest / dt) {
            max_acceleration.correct(highest / dt / steps);
        }
    }

    /// Returns the highest step rate that the times permit, Hz.
    double highest_rate(std::int64_t tick_ns) const noexcept {
        // times are rounded up to whole periods
        const auto ticks = [&](std::int64_t ns) { return (ns + tick_ns - 1) / tick_ns; };
        const std::int64_t pause = step_space ? ticks(*step_space) : 0;
        return 1e9 /
               static_cast<double>(std::max<std::int64_t>(1, ticks(step_length) + pause) * tick_ns);
    }

    /// Returns the rate for a command: within maxvel, reached within maxaccel also from above a
    /// lowered maxvel, and no higher than the pulse timing permits. A command that is not a number
    /// brakes to a standstill.
    double limited(double wanted, std::int64_t tick_ns, double dt) noexcept {
        if (!std::isfinite(wanted)) {
            wanted = 0.0;
        }
        if (const double asked = std::fabs(max_velocity * scale()); asked > 0.0) {
            wanted = std::clamp(wanted, -asked, asked);
        }
        if (const double a = acceleration(); a > 0.0) {
            wanted = std::clamp(wanted, frequency - a * dt, frequency + a * dt);
        }
        const double possible = highest_rate(tick_ns);
        return std::clamp(wanted, -possible, possible);
    }

    double acceleration() const noexcept { return std::fabs(max_acceleration * scale()); }
    double scale() const noexcept { return scale_.load(std::memory_order_relaxed); }

    /// Makes one step in `direction` if the timing allows it now, else later; no step is lost.
    void advance(int direction, const Order& wanted) noexcept {
        if (direction != direction_) {
            if (hold_ns_ > 0) return;
            direction_ = direction;
            setup_ns_ = wanted.setup_ns;
        }
        if (space_ns_ > 0 || setup_ns_ > 0) return;
        made_ += direction;
        high_ = true;
        pulse_ns_ = wanted.step_ns;
    }

    void show() noexcept {
        if (type == step_dir) {
            *first = high_;
            *second = direction_ < 0;
        } else if (type == up_down) {
            *first = high_ && direction_ > 0;
            *second = high_ && direction_ < 0;
        } else {
            const std::int64_t index = made_ % sequence_.length;
            const unsigned state =
                sequence_
                    .states[static_cast<std::size_t>(index < 0 ? index + sequence_.length : index)];
            for (int i = 0; i < sequence_.phases; ++i) {
                *phase_[static_cast<std::size_t>(i)] = ((state >> i) & 1u) != 0;
            }
        }
    }

    Sequence user_sequence() const {
        Sequence made{0, 0, {}};
        const char* at = user.get().c_str();
        unsigned used = 0;
        while (*at != '\0') {
            char* end = nullptr;
            const long state = std::strtol(at, &end, 0);
            if (end == at || (*end != ',' && *end != '\0') || state < 0 || state > 31 ||
                made.length == max_states) {
                throw hal::ArgumentError("user_step_type",
                                         "user_step_type=" + user.get() +
                                             " is not a list of up to 18 numbers from 0 to 31");
            }
            made.states[static_cast<std::size_t>(made.length++)] = static_cast<std::uint8_t>(state);
            used |= static_cast<unsigned>(state);
            at = *end == ',' ? end + 1 : end;
        }
        if (used == 0) throw hal::ArgumentError("step_type", "step_type=15 needs user_step_type=");
        while (used >> made.phases != 0) {
            ++made.phases;
        }
        return made;
    }

    Sequence sequence_{0, 1, {}};
    std::array<std::optional<hal::Out<bool>>, 5> phase_;

    const hal_faults* faults_ = hal::extension<hal_faults>("hal.faults/1");
    hal::FunctionMonitor updates_;  // make-pulses monitors update-freq
    hal::LastingFault abandoned_;  // make-pulses only
    std::atomic<bool> was_abandoned_{false};  // make-pulses sets it, update-freq takes it
    const std::string abandoned_text_ =
        hal::missing_function_text("stepgen.make-pulses", "stepgen.update-freq", "motor stopped");
    hal::Mailbox<Order> orders_;  // update-freq writes, make-pulses reads
    std::atomic<std::int64_t> tick_ns_{0};  // period of make-pulses: it writes, update-freq reads
    std::atomic<std::int64_t> made_out_{0};  // make-pulses writes, capture-position reads
    std::atomic<double> position_out_{0.0};  // make-pulses writes, the other two read
    hal::LastValid valid_scale_{*this, "position-scale", hal::finite_value, 1.0};  // update-freq
    std::atomic<double> scale_{1.0};  // update-freq writes, capture-position reads
    // make-pulses only
    double position_ = 0.0;  // where the motor should be, in steps
    std::int64_t made_ = 0;  // steps made
    double rate_ = 0.0;  // how fast that moves now, in steps per second
    int direction_ = 1;
    bool high_ = false;
    // remaining time of each
    std::int64_t pulse_ns_ = 0;
    std::int64_t space_ns_ = 0;
    std::int64_t hold_ns_ = 0;
    std::int64_t setup_ns_ = 0;
    // update-freq only
    double last_command_ = 0.0;
    hal::Interruption pulses_interrupted_{*this};  // accepted by make-pulses
    hal::Interruption updates_interrupted_{*this};  // accepted by update-freq
    hal::Retained retained_{*this,
                            {{"updates", updates_},
                             {"pulses-interrupted", pulses_interrupted_},
                             {"updates-interrupted", updates_interrupted_},
                             {"was-abandoned", was_abandoned_},
                             {"orders", orders_},
                             {"tick-ns", tick_ns_},
                             {"made-out", made_out_},
                             {"position-out", position_out_},
                             {"scale", scale_},
                             {"position", position_},
                             {"made", made_},
                             {"rate", rate_},
                             {"direction", direction_},
                             {"high", high_},
                             {"pulse-ns", pulse_ns_},
                             {"space-ns", space_ns_},
                             {"hold-ns", hold_ns_},
                             {"setup-ns", setup_ns_},
                             {"last-command", last_command_}}};
};

}  // namespace

HAL_COMPONENT(Stepgen, "stepgen",
              "Step pulses in software: step and direction, up and down, motor phases", R"(
`stepgen.make-pulses` generates the waveforms in the fastest thread; `stepgen.capture-position` and
`stepgen.update-freq` belong in the servo thread, before and after the controller. The three may run
on different CPUs.

`position-cmd` (ctrl_type=p) is followed as fast as `maxvel` and `maxaccel` allow without
overshooting a constant command: v = √(2 a e + (a T/2)²) - a T/2 for a distance e, plus the speed of
the command. `velocity-cmd` (ctrl_type=v) is followed within the same limits. With `maxaccel` the
speed changes linearly from one update to the next, without jumps, also after a change of `maxvel` or
`position-scale`. A command that is NaN or infinite brakes to a standstill within it. There is at most one step per period of the fast thread; a step
that must wait for one of the times below is delayed, never lost. A step occurs when the position
passes the midpoint between two steps.

| step_type | outputs | times used |
| --- | --- | --- |
| 0 | `step`, `dir` | steplen, stepspace, dirhold, dirsetup |
| 1 | `up`, `down` | steplen, stepspace, dirdelay |
| 2 | `phase-A`, `phase-B`: quadrature | steplen, dirdelay |
| 3, 4 | three phases: full step, half step | steplen, dirdelay |
| 5, 6 | four phases, unipolar full step: one phase on, two on | steplen, dirdelay |
| 7, 8 | four phases, bipolar full step: one bridge on, both on | steplen, dirdelay |
| 9, 10 | four phases, half step: unipolar, bipolar | steplen, dirdelay |
| 11, 12 | five phases, full step: one phase on, two on | steplen, dirdelay |
| 13, 14 | five phases, half step: one or two on, two or three on | steplen, dirdelay |
| 15 | defined by `user_step_type`: a number per state, bit 0 is phase A | steplen, dirdelay |

All times are in nanoseconds; the parameters are rounded up to whole periods of the fast thread. A
`steplen` of 0, and a `dirdelay` or both `dirhold` and `dirsetup` of 0 with step types 0 and 1, are
one period. A negative `maxvel` or `maxaccel` is set to 0; one that is above what the pulse timing
permits (for `maxaccel`: from 0 to the highest speed in one update) is set to that. With `stepspace`
0 a pulse may occur in every period, for ports that reset the pulse themselves. When `update-freq`,
which reads `enable`, has not run for 100 of its periods, the motor stops, and a fault names the
missing function. While `position-scale` is NaN or infinite, its last valid value applies, and a
fault names it; 0 is set to 1, as in LinuxCNC. After a stop of the threads the rate begins at 0 and
rises within `maxaccel`.

**Differences from LinuxCNC:** steps occur in different periods. A command with constant speed is
followed with a lag of one update (LinuxCNC: two and a half), and braking starts as late as
possible. Above a lowered `maxvel` a position command brakes within `maxaccel` (LinuxCNC: it runs at
`maxvel` at once). `position-fb` is exact (LinuxCNC: fixed point with a resolution of 2e-8 steps).
Without `maxaccel` the speed changes immediately (LinuxCNC: within an update). `dir` changes before
the first step back (LinuxCNC: when the speed changes its sign, even if no step follows).

    loadrt stepgen step_type=0,0 ctrl_type=p,v
    addf stepgen.make-pulses base-thread
    addf stepgen.capture-position servo-thread
    addf stepgen.update-freq servo-thread
    setp stepgen.0.position-scale 800
    setp stepgen.0.maxaccel 500
)")
