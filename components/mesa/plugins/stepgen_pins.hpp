// SPDX-License-Identifier: MIT
// Step generators.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "command_pin.hpp"
#include "dpll_pins.hpp"
#include "hal/limit.hpp"
#include "hal/retained.hpp"
#include "latch_timer.hpp"
#include "mesa/driver/position_counter.hpp"
#include "mesa/driver/step_control.hpp"
#include "mesa/driver/step_latch.hpp"
#include "mesa/hostmot2/formulas.hpp"
#include "mesa/hostmot2/registers.hpp"
#include "module_pins.hpp"
#include "scale_param.hpp"

namespace hal::mesa {

/// Index and probe of a step generator, of firmware that latches its position.
class StepgenLatch {
public:
    StepgenLatch(const PinOwner& o, unsigned unit)
        : position_latch_(o.component, o.read, named(unit, "position-latch"),
                          "position at the newest index or probe event"),
          index_enable_(o.component, named(unit, "index-enable"),
                        "TRUE: the next index makes the position 0 and this FALSE"),
          probe_enable_(o.component, named(unit, "probe-enable"),
                        "TRUE: the next event of the probe sets position-latch, and this to FALSE; "
                        "index-enable goes first"),
          index_invert_(o.component, o.write, named(unit, "index-invert"),
                        "TRUE: the rising edge of the index counts"),
          probe_invert_(o.component, o.write, named(unit, "probe-invert"),
                        "TRUE: the rising edge of the probe counts") {}

    /// `mode`: its register. Returns the event of an answer. [realtime] read
    LatchSource receive(std::uint32_t mode, const Reading& reading) noexcept {
        const bool begins_anew = reading.has_lost_power || reading.is_after_reset;
        return latch_.receive(mode, reading.writes_arrived, begins_anew);
    }
    /// [realtime] read
    void miss() noexcept { latch_.miss(); }
    /// Returns the accumulator at the event. [realtime] read
    std::int32_t accumulator() const noexcept {
        return static_cast<std::int32_t>(latch_.latched());
    }
    /// [realtime] read
    void show(LatchSource source, double position) noexcept {
        position_latch_ = position;
        if (source == LatchSource::index) {
            index_enable_ = false;
        } else {
            probe_enable_ = false;
        }
    }
    /// `mode`: the bits that are not those of the latch. [realtime] write
    void transmit(Outgoing& out, std::uint16_t address, std::uint32_t mode) noexcept {
        mode |= index_invert_ ? stepgen::index_polarity : 0;
        mode |= probe_invert_ ? stepgen::probe_polarity : 0;
        const auto value = latch_.transmit(mode, wanted());
        if (!value) return;
        out.put(address, *value);
        if (!out.is_complete()) {
            latch_.miss();
        }
    }

private:
    static const char* named(unsigned unit, const char* name) {
        return brief_name("stepgen.%02u.%s", unit, name);
    }
    LatchSource wanted() const noexcept {
        if (index_enable_) return LatchSource::index;
        return probe_enable_ ? LatchSource::probe : LatchSource::none;
    }

    StepLatch latch_;
    hal::Out<double> position_latch_;
    hal::Io<bool> index_enable_, probe_enable_;
    hal::In<bool> index_invert_, probe_invert_;
};

/// Times of the pulses of a step generator, in clocks. The card adds one to each.
struct StepPulse {
    std::uint32_t length = stepgen::max_time;
    std::uint32_t space = stepgen::max_time;

    /// Returns the highest rate, steps/s.
    double highest_rate(std::uint32_t clock_hz) const noexcept {
        return clock_hz / (length + space + 2.0);
    }
};

/// One step generator. The card turns the last rate into steps until it gets another one, so between
/// two readings the position is known as well:
///
///     position now = accumulator of the reading + rate x time since the reading
///
/// `position_` is that of the newest reading and `moved_` the second term, both in 1/65536 step.
class Stepgen {
public:
    Stepgen(const PinOwner& o, unsigned unit, const CardModule& module)
        : clock_hz_(module.clock_hz),
          rate_address_(module.addresses.at(stepgen::rate, unit)),
          mode_(module.addresses.at(stepgen::mode, unit)),
          length_(module.addresses.at(stepgen::pulse_length, unit)),
          space_(module.addresses.at(stepgen::pulse_space, unit)),
          setup_(module.addresses.at(stepgen::direction_setup, unit)),
          hold_(module.addresses.at(stepgen::direction_hold, unit)),
          position_cmd_(o, named(unit, "position-cmd"), "commanded position, with control-type 0",
                        "the step generator brakes"),
          velocity_cmd_(o, named(unit, "velocity-cmd"), "commanded velocity, with control-type 1",
                        "the step generator brakes"),
          enable_(o.component, o.write, named(unit, "enable"), "TRUE: steps are made"),
          control_type_(o.component, o.write, named(unit, "control-type"),
                        "FALSE: follows position-cmd; TRUE: velocity-cmd"),
          position_reset_(o.component, o.read, named(unit, "position-reset"),
                          "TRUE: the position is 0"),
          counts_(o.component, o.read, named(unit, "counts"), "position in steps"),
          position_fb_(o.component, o.read, named(unit, "position-fb"),
                       "position, with fractions of steps"),
          velocity_fb_(o.component, o.read, named(unit, "velocity-fb"), "velocity", {.safe = 0.0}),
          position_valid_(
              o.component, o.read, named(unit, "position-valid"),
              "FALSE: steps were made that the motor may not have followed, until "
              "enable becomes TRUE after it was FALSE; also while the card is lost, unless "
              "the motor stood",
              {.initial = true, .safe = false}),
          position_scale_(o.component, named(unit, "position-scale"),
                          "steps per unit; a change applies while enable is FALSE"),
          maxvel_(
              o.component, named(unit, "maxvel"),
              "maximum velocity, units/s; 0: what the times of the pulses allow; above a lowered "
              "one it brakes within maxaccel"),
          maxaccel_(o.component, named(unit, "maxaccel"),
                    "maximum acceleration, units/s2; 0: not limited", {.initial = 1.0}),
          steplen_(o.component, named(unit, "steplen"), "length of a pulse",
                   {.initial = slowest_ns(), .unit = "ns"}),
          stepspace_(o.component, named(unit, "stepspace"), "minimum time between pulses",
                     {.initial = slowest_ns(), .unit = "ns"}),
          dirsetup_(o.component, named(unit, "dirsetup"),
                    "time from a change of direction to a pulse",
                    {.initial = slowest_ns(), .unit = "ns"}),
          dirhold_(o.component, named(unit, "dirhold"),
                   "time from a pulse to a change of direction",
                   {.initial = slowest_ns(), .unit = "ns"}),
          step_type_(o.component, named(unit, "step_type"),
                     "0: step and direction, 1: up and down, 2: quadrature; a change applies while "
                     "enable is FALSE"),
          dbg_pos_minus_prev_cmd_(o.component, o.write, named(unit, "dbg_pos_minus_prev_cmd"),
                                  "position error of the control loop"),
          dbg_ff_vel_(o.component, o.write, named(unit, "dbg_ff_vel"), "velocity of position-cmd"),
          dbg_vel_error_(o.component, o.write, named(unit, "dbg_vel_error"),
                         "velocity less that of position-cmd"),
          dbg_s_to_match_(o.component, o.write, named(unit, "dbg_s_to_match"),
                          "time until the velocities match", {.unit = "s"}),
          dbg_err_at_match_(o.component, o.write, named(unit, "dbg_err_at_match"),
                            "position error when the velocities match"),
          dbg_step_rate_(o.component, o.write, named(unit, "dbg_step_rate"),
                         "rate register: steps/s x 2^32 / clock") {
        const std::uint8_t version = module.descriptor.version;
        if (version == stepgen::version_with_latch) {
            latch_ = place<StepgenLatch>(o, unit);
        }
        if (version == stepgen::version_with_latch || version == stepgen::version_with_swap) {
            swap_step_dir_ =
                place<hal::Param<bool>>(o.component, named(unit, "swap_step_dir"),
                                        "TRUE: the pins of step and direction are exchanged");
        }
        // one at a time: a name lasts until the next one
        hal::Retained(o.component, {{named(unit, "counter"), counter_}});
        hal::Retained(o.component, {{named(unit, "zero"), zero_}});
        hal::Retained(o.component, {{named(unit, "lost"), lost_}});
        hal::Retained(o.component, {{named(unit, "has-run"), has_run_}});
    }

    /// [realtime] read
    void receive(std::uint32_t accumulator, std::uint32_t mode, const Reading& reading) noexcept {
        if (!has_begun_ && has_run_) {
            // a reload: whether the motor stood meanwhile is unknown
            is_lost_by_reload_ = lose_position();
        }
        has_begun_ = true;
        has_run_ = true;
        adopt_settings();
        const double unseen_s = reading.gap_s + reading.pause_s;
        const bool may_have_wrapped = possible_steps(unseen_s) >= known_steps;
        is_unseen_ = false;
        unseen_run_s_ = 0.0;
        if (reading.writes_arrived && is_rate_sent_) {
            possible_rate_ = rate_;
        }
        moved_ += rate_per_s() * reading.period_s;
        const double since_reading = rate_per_s() * reading.age_s;
        const auto value = static_cast<std::int32_t>(accumulator);
        if (reading.is_after_reset) {
            // the accumulator has run on, or begins at 0: the motor did not follow it
            counter_.rebase(value);
            lost_ += std::exchange(held_moved_, 0.0);
            moved_ = 0.0;
            rate_ = 0;
        } else {
            const std::int64_t expected = std::llround(moved_ - since_reading);
            const std::int64_t before = counter_.position();
            const bool is_known = counter_.is_known();
            const std::int64_t beyond = counter_.update(value, expected) - before - expected;
            moved_ = since_reading;
            held_moved_ = 0.0;
            const bool is_in_doubt = reading.has_bitten || may_have_wrapped;
            if (is_known && reading.is_after_gap && is_in_doubt && rate_ == 0) {
                check_stop(beyond, reading.period_s);
            }
        }
        stopped_rate_ = 0;
        if (latch_) {
            follow_latch(value, latch_->receive(mode, reading));
        }
        show();
    }
    /// [realtime] read
    void miss(double period_s) noexcept {
        adopt_settings();
        unseen_run_s_ = std::max(unseen_run_s_ - period_s, 0.0);
        moved_ += rate_per_s() * period_s;
        if (latch_) {
            latch_->miss();
        }
        show();
    }
    /// The card is lost: from here on its motor stops at an unknown time. [realtime] read
    void hold() noexcept { held_moved_ = moved_; }
    /// No answers show what the card does: it may go on for `run_s`, until its watchdog bites.
    /// [realtime] read
    void lose_sight(double run_s) noexcept {
        is_unseen_ = true;
        unseen_run_s_ = run_s;
    }
    /// The outputs of the card were off while it may have had a rate: the motor did not follow. Returns
    /// whether the position, which was valid, is lost by that. [realtime] read
    bool was_off() noexcept { return is_moving(possible_rate_) && lose_position(); }
    /// Another master has the card: its rates are unknown. Returns whether the position was valid.
    /// [realtime] read
    bool was_taken() noexcept {
        has_stopped();
        return lose_position();
    }
    /// Returns true once after the generator has run on while its outputs were off. [realtime] read
    bool take_run_on() noexcept { return std::exchange(has_run_on_, false); }
    /// Returns true once after a setting has changed that waits until enable is FALSE. [realtime] read
    bool take_waiting() noexcept { return std::exchange(waits_newly_, false); }

    /// [realtime] write
    void transmit(Outgoing& out, const Writing& writing) noexcept {
        if (std::exchange(is_lost_by_reload_, false) && enable_) {
            has_run_on_ = true;
        }
        if (!enable_) {
            needs_edge_ = false;
            holds_settings_ = false;
        } else if (!needs_edge_) {
            is_lost_ = false;
        }
        const bool runs = writing.may_move && enable_ && !needs_edge_;
        adopt_pulse(runs);
        if (runs) {
            holds_settings_ = true;
            command(writing.period_s);
        } else {
            stand();
        }
        out.put(length_, pulse_.length);
        out.put(space_, pulse_.space);
        out.put(setup_, step_time(dirsetup_, clock_hz_));
        out.put(hold_, step_time(dirhold_, clock_hz_));
        if (latch_) {
            latch_->transmit(out, mode_.address(), mode_bits_);
        } else {
            out.put(mode_, mode_bits_);
        }
        out.put(rate_address_, static_cast<std::uint32_t>(rate_));
        is_rate_sent_ = true;
        if (std::abs(std::int64_t{rate_}) > std::abs(std::int64_t{possible_rate_})) {
            possible_rate_ = rate_;
        }
        dbg_step_rate_ = rate_;
    }
    /// [setup]
    void stop(Outgoing& out) const { out.put(rate_address_, 0); }
    /// [realtime] read
    void has_stopped() noexcept {
        stopped_rate_ = rate_ != 0 ? rate_ : stopped_rate_;
        rate_ = 0;
        is_rate_sent_ = false;  // an answer does not confirm what stops everything
    }
    bool is_valid() const noexcept {
        return !is_lost_ && !(is_unseen_ && is_moving(possible_rate_));
    }
    /// Returns whether it follows its enable again after it has lost its position. [realtime] read
    bool is_released() const noexcept { return !needs_edge_; }

private:
    static constexpr std::uint32_t slowest_ns() { return 163'830; }  // 3FFFh at 100 MHz
    /// Of a commanded position: the counter of the position has 2^47.
    static constexpr double max_steps = 0x1p46;
    /// Of an accumulator between two answers: it has 2^16.
    static constexpr double known_steps = 16384.0;

    /// Valid until the next call.
    static const char* named(unsigned unit, const char* name) {
        return brief_name("stepgen.%02u.%s", unit, name);
    }

    /// A generator that stands corrects its position with fractions of a step per second, so hardly
    /// anything is unknown after the time until the watchdog bites.
    bool is_moving(std::int32_t rate) const noexcept {
        return std::abs(steps_per_s(rate, clock_hz_)) > 1.0;
    }
    double scale() const noexcept { return scale_; }
    /// Returns the rate in 1/65536 steps per second.
    double rate_per_s() const noexcept {
        return steps_per_s(rate_, clock_hz_) * accumulator_per_step;
    }
    double position() const noexcept { return position_at(counter_.position(), moved_); }
    /// Returns the position at a count of the accumulator, and `beyond` behind it.
    double position_at(std::int64_t count, double beyond) const noexcept {
        const double whole = static_cast<double>(count - zero_);
        return (whole + lost_ + beyond) / accumulator_per_step / scale();
    }
    StepControl::Limits limits() const noexcept {
        const double steps_per_unit = std::abs(scale());
        StepControl::Limits limits;
        limits.velocity = wanted_pulse().highest_rate(clock_hz_) / steps_per_unit;
        if (const double wanted = std::abs(maxvel_.get()); wanted > 0.0) {
            limits.velocity = std::min(limits.velocity, wanted);
        }
        limits.acceleration = std::abs(maxaccel_.get());
        limits.possible = pulse_.highest_rate(clock_hz_) / steps_per_unit;
        return limits;
    }

    StepPulse wanted_pulse() const noexcept {
        return {step_time(steplen_, clock_hz_), step_time(stepspace_, clock_hz_)};
    }
    /// Pulses that need more time wait until the generator has braked to the rate that they allow.
    void adopt_pulse(bool runs) noexcept {
        const StepPulse wanted = wanted_pulse();
        const double rate = std::abs(steps_per_s(rate_, clock_hz_));
        if (!runs || rate <= wanted.highest_rate(clock_hz_)) {
            pulse_ = wanted;
        }
    }
    std::uint32_t wanted_mode() const noexcept {
        const std::uint32_t type = std::min<std::uint32_t>(step_type_, 2);
        return swap_step_dir_ && *swap_step_dir_ ? type | stepgen::swap_step_direction : type;
    }
    /// Another scale would move the axis, or turn it around; another mode would turn its steps into
    /// others. Both wait until enable is FALSE.
    void adopt_settings() noexcept {
        const double scale = position_scale_;
        const std::uint32_t mode = wanted_mode();
        const bool differs = scale != scale_ || mode != mode_bits_;
        const bool waits = holds_settings_ && differs;
        waits_newly_ = waits_newly_ || (waits && !waits_);
        waits_ = waits;
        if (waits) return;
        scale_ = scale;
        mode_bits_ = mode;
    }
    /// `value`: the accumulator of the answer that shows the event.
    void follow_latch(std::int32_t value, LatchSource source) noexcept {
        if (source == LatchSource::none) return;
        const auto since = static_cast<std::int32_t>(
            static_cast<std::uint32_t>(value) - static_cast<std::uint32_t>(latch_->accumulator()));
        const std::int64_t count = counter_.position() - since;
        const double at = position_at(count, 0.0);
        latch_->show(source, at);
        if (source == LatchSource::index) {
            zero_ = count;
            lost_ = 0.0;
            control_.move_origin(at);
        }
    }

    /// Returns the steps that the card may have made in a time without an answer.
    double possible_steps(double unseen_s) const noexcept {
        return std::abs(steps_per_s(possible_rate_, clock_hz_)) * unseen_s;
    }
    /// Where the outputs were switched off and the rate 0 has not arrived, the motor has stopped, and
    /// the accumulator has not. When it stopped is known to some cycles. Where they were not, the
    /// motor has followed, but the accumulator of 32 bits may have wrapped.
    void check_stop(std::int64_t beyond, double period_s) noexcept {
        const double per_cycle =
            steps_per_s(stopped_rate_, clock_hz_) * accumulator_per_step * period_s;
        const double tolerated = 2.0 * accumulator_per_step + 4.0 * std::abs(per_cycle);
        if (std::abs(static_cast<double>(beyond)) <= tolerated) return;
        lost_ -= static_cast<double>(beyond);
        has_run_on_ = true;
        lose_position();
    }
    /// Returns whether that is new.
    bool lose_position() noexcept {
        is_lost_ = true;
        return !std::exchange(needs_edge_, true);
    }

    void stand() noexcept {
        position_cmd_.ignore();
        velocity_cmd_.ignore();
        rate_ = 0;
        control_.hold(position_cmd_);
    }
    double next_velocity(double at, double period_s, const StepControl::Limits& limits) noexcept {
        if (control_type_) {
            position_cmd_.ignore();
            const auto velocity = velocity_cmd_.valid();
            return velocity ? control_.follow_velocity(*velocity, at, period_s, limits)
                            : control_.brake(at, period_s, limits);
        }
        velocity_cmd_.ignore();
        const auto position = position_cmd_.valid(max_steps / std::abs(scale()));
        return position ? control_.follow_position(*position, at, period_s, limits)
                        : control_.brake(at, period_s, limits);
    }
    void command(double period_s) noexcept {
        const double at = position();
        const StepControl::Limits limits = this->limits();
        const double before = control_.velocity();
        dbg_pos_minus_prev_cmd_ = at - control_.command();
        const double velocity = next_velocity(at, period_s, limits);
        rate_ = step_rate(velocity * scale(), clock_hz_);
        control_.set_velocity(steps_per_s(rate_, clock_hz_) / scale());
        const double error = before - control_.feed_forward();
        dbg_ff_vel_ = control_.feed_forward();
        dbg_vel_error_ = error;
        dbg_s_to_match_ = limits.acceleration > 0.0 ? std::abs(error) / limits.acceleration : 0.0;
        dbg_err_at_match_ = control_.error_at_match();
    }

    void show() noexcept {
        if (position_reset_) {
            zero_ = counter_.position();
            lost_ = 0.0;
        }
        const double steps = position() * scale();
        counts_ = static_cast<std::int32_t>(static_cast<std::int64_t>(std::floor(steps)));
        position_fb_ = steps / scale();
        const std::int32_t rate = unseen_run_s_ > 0.0 ? possible_rate_ : rate_;
        velocity_fb_ = steps_per_s(rate, clock_hz_) / scale();
        position_valid_ = is_valid();
    }

    const std::uint32_t clock_hz_;
    const std::uint16_t rate_address_;
    Setting mode_, length_, space_, setup_, hold_;
    PositionCounter<std::int32_t> counter_;
    StepControl control_;
    double moved_ = 0.0;
    double held_moved_ = 0.0;  ///< when the card was lost
    double lost_ = 0.0;  ///< positions before resets of the card
    std::int64_t zero_ = 0;
    std::int32_t rate_ = 0;  ///< in the card
    bool is_rate_sent_ = false;  ///< by writes that an answer confirms
    std::int32_t possible_rate_ = 0;  ///< the greatest one that the card may have
    std::int32_t stopped_rate_ = 0;  ///< when everything was stopped, until an answer confirms it
    bool needs_edge_ = false;  ///< it stands until its enable is FALSE
    bool is_lost_ = false;  ///< until it is enabled again behind that
    bool has_run_on_ = false;
    bool is_lost_by_reload_ = false;  ///< until the next write, which knows its enable
    bool is_unseen_ = false;  ///< no answer since the card was lost
    double unseen_run_s_ = 0.0;  ///< how long it may go on
    double scale_ = 1.0;  ///< that applies
    std::uint32_t mode_bits_ = 0;  ///< that apply
    StepPulse pulse_;  ///< that applies
    bool holds_settings_ = false;  ///< it has run since enable was FALSE
    bool waits_ = false;  ///< a changed setting
    bool waits_newly_ = false;
    bool has_begun_ = false;
    bool has_run_ = false;  ///< also in the version before a reload

    CommandPin position_cmd_, velocity_cmd_;
    hal::In<bool> enable_, control_type_, position_reset_;
    hal::Out<std::int32_t> counts_;
    hal::Out<double> position_fb_, velocity_fb_;
    hal::Out<bool> position_valid_;
    ScaleParam position_scale_;
    hal::OptionalLimitParam maxvel_, maxaccel_;
    hal::Param<std::uint32_t> steplen_, stepspace_, dirsetup_, dirhold_, step_type_;
    Placed<hal::Param<bool>> swap_step_dir_;  ///< of firmware that can
    Placed<StepgenLatch> latch_;  ///< the same
    hal::Out<double> dbg_pos_minus_prev_cmd_, dbg_ff_vel_, dbg_vel_error_, dbg_s_to_match_,
        dbg_err_at_match_;
    hal::Out<std::int32_t> dbg_step_rate_;
};

class StepgenPins final : public ModulePins {
public:
    /// `dpll` is nullptr without one, and outlives it.
    StepgenPins(const PinOwner& o, const CardModule& module, const DpllPins* dpll)
        : addresses_(module.addresses),
          dpll_(dpll),
          has_latches_(module.descriptor.version == stepgen::version_with_latch),
          units_(make_units<Stepgen>(o, module)),
          master_rate_(module.addresses.at(stepgen::master_rate)) {
        if (dpll_ != nullptr) {
            timer_.emplace(o, "stepgen.timer-number",
                           "timer of the DPLL that latches positions, 0..4; -1: none",
                           module.addresses.at(stepgen::dpll_timer));
        }
    }

    void plan(ReadLayout& layout) override {
        if (!units_.empty()) {
            accumulators_ = layout.add_instances(addresses_, stepgen::accumulator, units_.size());
        }
        if (has_latches_) {
            modes_ = layout.add_instances(addresses_, stepgen::mode, units_.size());
        }
    }
    void receive(const Reply& reply, const Reading& reading) noexcept override {
        Reading own = reading;
        if (timer_) {
            own.age_s += dpll_->latched_before_s(timer_->number(), reading.period_s);
        }
        for (std::size_t n = 0; n < units_.size(); ++n) {
            const std::uint32_t mode = has_latches_ ? reply.word(modes_, n) : 0;
            units_[n]->receive(reply.word(accumulators_, n), mode, own);
        }
    }
    void miss(double period_s) noexcept override {
        for (const auto& unit : units_) {
            unit->miss(period_s);
        }
    }
    void transmit(Outgoing& out, const Writing& writing) noexcept override {
        if (units_.empty()) return;
        out.put(master_rate_, stepgen::all_masters);
        if (timer_) {
            timer_->transmit(out);
        }
        for (const auto& unit : units_) {
            unit->transmit(out, writing);
        }
    }
    void stop(Outgoing& out) const override {
        for (const auto& unit : units_) {
            unit->stop(out);
        }
    }
    void has_stopped() noexcept override {
        for (const auto& unit : units_) {
            unit->has_stopped();
        }
    }
    /// Calls `report(unit)` for each one whose position is lost. [realtime]
    template <class Report>
    void was_off(Report&& report) noexcept {
        report_each(units_, &Stepgen::was_off, report);
    }
    /// The same for each one that has run on while its outputs were off. [realtime]
    template <class Report>
    void take_run_on(Report&& report) noexcept {
        report_each(units_, &Stepgen::take_run_on, report);
    }
    /// The same for each one with a changed setting that waits until its enable is FALSE. [realtime]
    template <class Report>
    void take_waiting(Report&& report) noexcept {
        report_each(units_, &Stepgen::take_waiting, report);
    }
    /// Another master has the card. Calls `report(unit)` as was_off() does. [realtime]
    template <class Report>
    void were_taken(Report&& report) noexcept {
        report_each(units_, &Stepgen::was_taken, report);
    }
    void hold() noexcept {
        for (const auto& unit : units_) {
            unit->hold();
        }
    }
    void lose_sight(double run_s) noexcept {
        for (const auto& unit : units_) {
            unit->lose_sight(run_s);
        }
    }
    bool positions_are_valid() const noexcept {
        return std::ranges::all_of(units_, [](const auto& unit) { return unit->is_valid(); });
    }
    bool are_released() const noexcept {
        return std::ranges::all_of(units_, [](const auto& unit) { return unit->is_released(); });
    }

private:
    const ModuleAddresses addresses_;
    const DpllPins* const dpll_;
    const bool has_latches_;
    std::vector<Placed<Stepgen>> units_;
    Setting master_rate_;
    std::optional<LatchTimer> timer_;
    std::size_t accumulators_ = 0;
    std::size_t modes_ = 0;
};

}  // namespace hal::mesa
