// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "hal/component.hpp"
#include "hal/function_monitor.hpp"
#include "hal/last_valid.hpp"
#include "hal/lasting_fault.hpp"
#include "hal/limit.hpp"
#include "hal/queue.hpp"
#include "hal/retained.hpp"

namespace {

/// The command of `update` for `make-pulses`.
struct Order {
    bool on = false;
    bool reverse = false;
    bool dither = false;
    double duty = 0.0;    // 0 to 1
    double period = 0.0;  // of the PWM, in periods of make-pulses; 0: pulse density modulation
};

struct Pwmgen : hal::Component {
    enum Type { single, with_direction, up_down };

    hal::Argument type{
        *this,
        "output_type",
        0,
        "0: one output, 1: output and direction, 2: up and down; one number per instance",
        {.per_instance = true, .min = 0, .max = 2}};

    hal::Function make{*this,
                       "make-pulses",
                       &Pwmgen::make_pulses,
                       "generates the waveforms; belongs in the fastest thread",
                       {.shared = true}};
    std::optional<hal::Out<bool>> pwm, dir, up, down;

    hal::Function run{*this,
                      "update",
                      &Pwmgen::update,
                      "computes the duty cycles; belongs in the servo thread",
                      {.shared = true}};
    hal::In<bool> enable{*this, run, "enable", "FALSE sets all outputs low"};
    hal::In<double> value{*this, run, "value",
                          "commanded value: scale is full duty forward, -scale in reverse"};
    hal::Io<double> scale{*this, run, "scale", "value for full duty", {.initial = 1.0}};
    hal::Io<double> offset{*this, run, "offset",
                           "added to the duty cycle: dc = value / scale + offset"};
    hal::LimitIo min_duty{*this, run, "min-dc", "minimum duty cycle while enabled, 0..1"};
    hal::LimitIo max_duty{*this, run, "max-dc", "maximum duty cycle, 0..1", {.initial = 1.0}};
    hal::Io<double> frequency{
        *this,
        run,
        "pwm-freq",
        "PWM frequency, rounded to a possible one; 0: pulse density modulation",
        {.unit = "Hz"}};
    hal::Io<bool> dither{
        *this, run, "dither-pwm",
        "TRUE: the duty cycle alternates between two steps so that its average is exact"};
    hal::Out<double> duty{*this, run, "curr-dc",
                          "duty cycle after scaling, limits and rounding, -1..1"};

    explicit Pwmgen(const hal_host* host) : Component(host) {
        const hal::PinOptions<bool> off{.safe = false};
        if (type == up_down) {
            up.emplace(*this, make, "up", "waveform for positive values", off);
            down.emplace(*this, make, "down", "waveform for negative values", off);
            return;
        }
        pwm.emplace(*this, make, "pwm", "waveform", off);
        if (type == with_direction) {
            dir.emplace(*this, make, "dir", "direction: low forward, high in reverse", off);
        }
    }

    void make_pulses(hal::Cycle cycle) noexcept {
        tick_ns_.store(cycle.period_ns(), std::memory_order_relaxed);
        const Order& wanted = orders_.get();
        const bool abandoned = updates_.is_missing(cycle.period_ns()) && updates_.has_run();
        record_abandoned(abandoned);
        if (!wanted.on || abandoned) {
            tick_ = 0;
            length_rest_ = high_rest_ = density_ = 0.0;
            drive(false, false);
            return;
        }
        // decides on reverse_ too, so it comes first
        const bool level = wanted.period > 0.0 ? pulse(wanted) : dense(wanted);
        drive(level, reverse_);
    }

    void update(hal::Cycle cycle) noexcept {
        updates_.ran(cycle.period_ns());
        const auto tick_ns = static_cast<double>(tick_ns_.load(std::memory_order_relaxed));
        Order next;
        if (tick_ns > 0.0) {
            next = order(tick_ns);
        }
        duty = next.reverse ? -next.duty : next.duty;
        orders_.put(next);
    }

private:
    Order order(double tick_ns) noexcept {
        if (scale == 0.0) {
            scale = 1.0;
        }
        max_duty = std::clamp(max_duty.get(), 0.0, 1.0);
        min_duty = std::clamp(min_duty.get(), 0.0, max_duty.get());

        const double raw = value / valid_scale_.follow(scale) + offset;
        if (!enable || !std::isfinite(raw)) {
            return {};
        }
        Order next;
        next.on = true;
        next.dither = dither;
        next.reverse = type != single && raw < 0.0;
        next.duty = std::clamp(next.reverse ? -raw : raw, min_duty.get(), max_duty.get());

        if (!std::isfinite(frequency) || frequency < 0.0) {
            frequency = 0.0;
        }
        if (frequency == 0.0) return next;
        const double tick_hz = 1e9 / tick_ns;
        double period = std::max(2.0, tick_hz / frequency);
        if (!dither) {
            period = std::round(period);
            next.duty = std::round(next.duty * period) / period;
        }
        // Written only on a change: repeated rounding must not let the frequency drift.
        if (std::fabs(tick_hz / period - frequency) > 1e-9 * frequency) {
            frequency = tick_hz / period;
        }
        next.period = period;
        return next;
    }

    /// Runs one tick of PWM. A period takes the newest command at its start only, as hardware with
    /// buffered registers does; the next period compensates its rounding to whole ticks.
    bool pulse(const Order& wanted) noexcept {
        if (tick_ == 0) {
            const double length = wanted.period + length_rest_;

            const double high = wanted.duty * wanted.period + (wanted.dither ? high_rest_ : 0.0);
            length_ = std::max<std::int64_t>(1, std::llround(length));
            high_ = std::clamp<std::int64_t>(std::llround(high), 0, length_);
            length_rest_ = length - static_cast<double>(length_);
            high_rest_ = std::clamp(high - static_cast<double>(high_), -1.0, 1.0);
            reverse_ = wanted.reverse;
        }
        const bool level = tick_ < high_;
        tick_ = tick_ + 1 >= length_ ? 0 : tick_ + 1;
        return level;
    }

    /// Runs one tick of pulse density modulation: the duty cycle accumulates, and each whole one is
    /// a pulse.
    bool dense(const Order& wanted) noexcept {
        tick_ = 0;
        reverse_ = wanted.reverse;
        density_ += wanted.duty;
        const bool level = density_ >= 1.0 - 1e-12;
        if (level) {
            density_ -= 1.0;
        }
        return level;
    }

    void drive(bool level, bool reverse) noexcept {
        if (up) {
            *up = level && !reverse;
            *down = level && reverse;
            return;
        }
        *pwm = level;
        if (dir) {
            *dir = reverse;
        }
    }

    void record_abandoned(bool abandoned) noexcept {
        if (abandoned && !abandoned_.lasts()) {
            abandoned_.begin(faults_, this, abandoned_text_.c_str());
        } else if (!abandoned && abandoned_.lasts()) {
            abandoned_.end(faults_, this);
        }
    }

    const hal_faults* faults_ = hal::extension<hal_faults>("hal.faults/1");
    hal::LastValid valid_scale_{*this, "scale", hal::finite_value, 1.0};  // update
    hal::FunctionMonitor updates_;  // make-pulses monitors update
    hal::LastingFault abandoned_;  // make-pulses only
    const std::string abandoned_text_ =
        hal::missing_function_text("pwmgen.make-pulses", "pwmgen.update", "outputs off");
    hal::Mailbox<Order> orders_;  // update writes, make-pulses reads
    std::atomic<std::int64_t> tick_ns_{0};  // period of make-pulses: it writes, update reads
    // make-pulses only
    std::int64_t tick_ = 0;
    std::int64_t length_ = 1;
    std::int64_t high_ = 0;
    double length_rest_ = 0.0;
    double high_rest_ = 0.0;
    double density_ = 0.0;
    bool reverse_ = false;
    hal::Retained retained_{*this,
                            {{"updates", updates_},
                             {"orders", orders_},
                             {"tick-ns", tick_ns_},
                             {"tick", tick_},
                             {"length", length_},
                             {"high", high_},
                             {"length-rest", length_rest_},
                             {"high-rest", high_rest_},
                             {"density", density_},
                             {"reverse", reverse_}}};
};

}  // namespace

HAL_COMPONENT(Pwmgen, "pwmgen", "Pulse width and pulse density modulation in software", R"(
`pwmgen.update` converts the values of all instances to duty cycles and belongs in the servo thread,
after the controller; `pwmgen.make-pulses` generates the waveforms in the fastest thread. The two
may run on different CPUs.

    dc = value / scale + offset, kept between min-dc and max-dc (and between -max-dc and -min-dc)

| output_type | outputs | negative values |
| --- | --- | --- |
| 0 | `pwm` | give min-dc |
| 1 | `pwm`, `dir` | set `dir` |
| 2 | `up`, `down` | pulse on `down` instead of `up` |

* **PWM** (`pwm-freq` above 0): without `dither-pwm` the period is a whole number of fast periods
  and the duty one of as many steps; `pwm-freq` and `curr-dc` show what came out. With `dither-pwm`
  frequency and duty are exact in the average. The upper limit is half the rate of the fast thread.
  A new value begins with the next period; FALSE on `enable` acts at once.
* **PDM** (`pwm-freq` 0): single pulses of one fast period, spread evenly; resolution is that of the
  average.

All outputs go low on stop, unload and faults, and when `update`, which reads `enable`, has not run
for 100 of its periods (a fault names it). A `min-dc` or `max-dc` that is NaN is set to its last
valid value, and a fault is raised. A `scale` that is NaN or infinite remains, and its last valid
value applies; 0 is set to 1, as in LinuxCNC.

**Differences from LinuxCNC:** the waveforms are the same except in these cases. The first PWM
period starts with `enable` (LinuxCNC: the outputs stay low for up to a period, and all periods
start one fast period earlier). `dir` changes between periods, so that no period has both directions
(LinuxCNC: within a period, in `update`, a fast period earlier). `dir` is FALSE and `curr-dc` 0
while disabled (LinuxCNC: both are updated). PDM generates its first pulse when the accumulated duty
cycle reaches one (LinuxCNC: immediately). A `scale` set before the first cycle is used (LinuxCNC
ignores a scale of 2).

    loadrt pwmgen output_type=1
    loadrt pid
    addf pwmgen.make-pulses base-thread
    addf pid.0.do-pid-calcs servo-thread
    addf pwmgen.update servo-thread
    setp pwmgen.0.pwm-freq 1000
    setp pwmgen.0.scale 24
    net effort pid.0.output => pwmgen.0.value
)")
