// SPDX-License-Identifier: MIT
// Encoders, also multiplexed ones.
#pragma once

#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "hal/retained.hpp"
#include "latch_timer.hpp"
#include "mesa/driver/edge_velocity.hpp"
#include "mesa/driver/position_counter.hpp"
#include "mesa/driver/step_latch.hpp"
#include "mesa/hostmot2/formulas.hpp"
#include "mesa/hostmot2/registers.hpp"
#include "module_pins.hpp"
#include "scale_param.hpp"
#include "valid_pin.hpp"

namespace hal::mesa {

/// One encoder. The index is latched by the card: `index-enable` writes two bits of its control
/// register, "latch on index" and "just once". The card clears the first at the event, and the
/// second stays, so a reading shows without a doubt which of these is the case, also when datagrams
/// were lost in between:
///
///   latch  once
///   0      0      not armed: the write has not arrived
///   1      1      armed
///   0      1      the index has been seen; its count is in the upper half
///
/// The probe of newer firmware is latched in the same way by a bit of its own.
class Encoder {
public:
    Encoder(const PinOwner& o, unsigned unit, const CardModule& module)
        : control_address_(module.addresses.at(encoder::control, unit)),
          count_(o.component, o.read, named(unit, "count"), "counts since the last reset"),
          rawcounts_(o.component, o.read, named(unit, "rawcounts"), "counts since the start"),
          rawlatch_(o.component, o.read, named(unit, "rawlatch"),
                    "rawcounts at the last index or probe event"),
          count_latched_(o.component, o.read, named(unit, "count-latched"),
                         "count at the last index or probe event"),
          position_(o.component, o.read, named(unit, "position"), "position, count / scale"),
          position_latched_(o.component, o.read, named(unit, "position-latched"),
                            "position at the last index or probe event"),
          position_interpolated_(o.component, o.read, named(unit, "position-interpolated"),
                                 "position, interpolated between counts by the velocity"),
          velocity_(o.component, o.read, named(unit, "velocity"), "velocity, units/s",
                    {.safe = 0.0}),
          velocity_rpm_(o.component, o.read, named(unit, "velocity-rpm"), "velocity, units/min",
                        {.safe = 0.0}),
          quad_error_(o.component, o.read, named(unit, "quad-error"),
                      "A and B have changed at the same time since quad-error-enable became TRUE"),
          position_valid_(o.component, o.read, named(unit, "position-valid"),
                          "FALSE: counts may be lost, because the card was lost while the encoder "
                          "turned fast, or for longer than 1 s; TRUE again after reset or an index "
                          "that clears the count",
                          {.initial = true, .safe = false}),
          input_a_(o.component, o.read, named(unit, "input-a"), "level of A"),
          input_b_(o.component, o.read, named(unit, "input-b"), "level of B"),
          input_index_(o.component, o.read, named(unit, "input-index"), "level of the index"),
          reset_(o.component, o.read, named(unit, "reset"), "TRUE: count and position are 0"),
          no_clear_on_index_(o.component, o.read, named(unit, "no_clear_on_index"),
                             "TRUE: the index is latched, and the count goes on"),
          quad_error_enable_(o.component, o.read, named(unit, "quad-error-enable"),
                             "TRUE: quad-error is shown; a rising edge clears an earlier error"),
          index_enable_(o.component, named(unit, "index-enable"),
                        "TRUE: the next index makes the count 0 and this FALSE"),
          scale_(o.component, named(unit, "scale"), "counts per unit"),
          index_invert_(o.component, named(unit, "index-invert"),
                        "TRUE: the rising edge of the index counts"),
          index_mask_(o.component, named(unit, "index-mask"),
                      "TRUE: the index counts only while the mask input is TRUE"),
          index_mask_invert_(o.component, named(unit, "index-mask-invert"),
                             "TRUE: only while it is FALSE"),
          counter_mode_(o.component, named(unit, "counter-mode"),
                        "FALSE: quadrature; TRUE: step on A, direction on B"),
          filter_(o.component, named(unit, "filter"),
                  "TRUE: a level counts after 15 samples; FALSE: after 3", {.initial = true}),
          vel_timeout_(o.component, named(unit, "vel-timeout"),
                       "time without a count until the velocity is 0", time_value,
                       {.initial = 0.5, .unit = "s"}) {
        // one at a time: a name lasts until the next one
        hal::Retained(o.component, {{named(unit, "counter"), counter_}});
        hal::Retained(o.component, {{named(unit, "zero"), zero_}});
        hal::Retained(o.component, {{named(unit, "is-uncertain"), is_uncertain_}});
        if ((module.descriptor.version & encoder::version_with_probe) != 0) {
            probe_ = place<Probe>(o, unit);
        }
    }

    /// `count`: count and time of its edge; `control`: control and latch. [realtime] read
    void receive(std::uint32_t count, std::uint32_t control, std::uint16_t now_ticks,
                 double ticks_hz, const Reading& reading) noexcept {
        const auto value = static_cast<std::int16_t>(count & 0xffffU);
        const auto edge_ticks = static_cast<std::uint16_t>(count >> 16);
        const std::int64_t before = counter_.position();
        if (!counter_.is_known() || reading.has_lost_power) {
            counter_.rebase(value);
            speed_.restart(now_ticks);
        }
        const double in_gap = speed_.velocity() * reading.gap_s;
        counter_.update(value, std::llround(in_gap));
        if (reading.is_after_gap) {
            may_have_lost_ =
                reading.has_lost_power || std::abs(in_gap) > max_known || reading.gap_s > max_gap_s;
            is_uncertain_ = is_uncertain_ || may_have_lost_;
            speed_.restart(now_ticks);
        } else {
            speed_.update({counter_.position() - before, edge_ticks, now_ticks}, ticks_hz,
                          vel_timeout_);
        }
        has_old_error_ = has_old_error_ && !(is_clearing_ && reading.writes_arrived);
        read_control(control);
        follow_latch(value, static_cast<std::int16_t>(control >> 16));
        show();
    }
    /// Returns true once after a gap in which it may have lost counts. [realtime] read
    bool take_loss() noexcept { return std::exchange(may_have_lost_, false); }
    /// [realtime] write
    void transmit(Outgoing& out, const Writing&) noexcept {
        is_clearing_ = false;
        if (!is_read_) return;  // what is to be written depends on what is there
        is_read_ = false;
        const LatchSource source = wanted_source();
        const std::uint32_t settings = this->settings();
        const bool is_armed = (control_ & encoder::just_once) != 0;
        const bool differs = (control_ & setting_bits) != settings;
        if (!is_armed) {
            is_done_ = false;
        }
        // after an event, and for another source, the bits are cleared before they are set again
        const bool stays = is_armed && !is_done_ && source == source_;
        const bool arms = source != LatchSource::none && !is_armed;
        if (stays || (!arms && !is_armed && !differs && !has_old_error_)) return;
        if (arms) {
            source_ = source;
        }
        out.put(control_address_, arms ? settings | arming_bits(source) : settings);
        is_clearing_ = out.is_complete();  // each write clears an error
    }

private:
    /// counts that may pass in a gap without a doubt about wraps of the register
    static constexpr double max_known = 8192.0;
    /// s; in a longer gap it may have begun to turn, so far that the register has wrapped
    static constexpr double max_gap_s = 1.0;
    static constexpr std::uint32_t setting_bits = encoder::index_polarity | encoder::mask_polarity |
                                                  encoder::use_mask | encoder::count_up_down |
                                                  encoder::filter_15 | encoder::probe_polarity;

    static const char* named(unsigned unit, const char* name) {
        return brief_name("encoder.%02u.%s", unit, name);
    }
    struct Probe {
        Probe(const PinOwner& o, unsigned unit)
            : enable(o.component, named(unit, "probe-enable"),
                     "TRUE: the next event of the probe is latched, and makes this FALSE; "
                     "index-enable goes first"),
              invert(o.component, o.read, named(unit, "probe-invert"),
                     "TRUE: the rising edge of the probe counts") {}
        hal::Io<bool> enable;
        hal::In<bool> invert;
    };

    LatchSource wanted_source() const noexcept {
        if (index_enable_) return LatchSource::index;
        return probe_ && probe_->enable ? LatchSource::probe : LatchSource::none;
    }
    /// Returns what the register arms, also before a reload of the component.
    LatchSource armed_source() const noexcept {
        if ((control_ & encoder::just_once) == 0) return LatchSource::none;
        if ((control_ & encoder::latch_on_index) != 0) return LatchSource::index;
        const bool is_probe = (control_ & encoder::latch_on_probe) != 0;
        return is_probe ? LatchSource::probe : LatchSource::none;
    }
    static std::uint32_t arming_bits(LatchSource source) noexcept {
        const bool is_index = source == LatchSource::index;
        return encoder::just_once | (is_index ? encoder::latch_on_index : encoder::latch_on_probe);
    }
    std::uint32_t settings() const noexcept {
        std::uint32_t bits = filter_ ? encoder::filter_15 : 0;
        bits |= counter_mode_ ? encoder::count_up_down : 0;
        bits |= index_invert_ ? encoder::index_polarity : 0;
        bits |= index_mask_ ? encoder::use_mask : 0;
        bits |= index_mask_invert_ ? encoder::mask_polarity : 0;
        bits |= probe_ && probe_->invert ? encoder::probe_polarity : 0;
        return bits;
    }
    void read_control(std::uint32_t control) noexcept {
        control_ = control & 0xffffU;
        is_read_ = true;
        if (source_ == LatchSource::none) {
            source_ = armed_source();
        }
        input_a_ = (control & encoder::input_a) != 0;
        input_b_ = (control & encoder::input_b) != 0;
        input_index_ = (control & encoder::input_index) != 0;
        show_error((control & encoder::quadrature_error) != 0);
    }
    /// An error from before quad-error-enable is not shown: it is cleared in the card, once no latch
    /// is armed.
    void show_error(bool is_set) noexcept {
        const bool was_enabled = std::exchange(shows_error_, quad_error_enable_);
        has_old_error_ = shows_error_ && is_set && (has_old_error_ || !was_enabled);
        quad_error_ = shows_error_ && is_set && !has_old_error_;
    }
    void follow_latch(std::int16_t value, std::int16_t latch) noexcept {
        constexpr std::uint32_t armed_bits = encoder::latch_on_index | encoder::latch_on_probe;
        const bool is_seen = (control_ & encoder::just_once) != 0 && (control_ & armed_bits) == 0;
        if (!is_seen || is_done_) return;
        if (source_ == LatchSource::none) {
            source_ = wanted_source();  // armed before a reload
        }
        if (source_ == LatchSource::none || source_ != wanted_source()) return;
        is_done_ = true;
        // the latch is from less than half of the range ago
        const auto since = static_cast<std::int16_t>(static_cast<std::uint16_t>(value) -
                                                     static_cast<std::uint16_t>(latch));
        const std::int64_t raw = counter_.position() - since;
        rawlatch_ = static_cast<std::int32_t>(raw);
        latched_ = raw - zero_;
        if (source_ == LatchSource::probe) {
            probe_->enable = false;
            return;
        }
        if (!no_clear_on_index_) {
            zero_ = raw;
            is_uncertain_ = false;
        }
        index_enable_ = false;
    }
    void show() noexcept {
        if (reset_) {
            zero_ = counter_.position();
            is_uncertain_ = false;
        }
        position_valid_ = !is_uncertain_;
        const double by = scale_;
        const std::int64_t count = counter_.position() - zero_;
        const double velocity = speed_.velocity() / by;
        rawcounts_ = static_cast<std::int32_t>(counter_.position());
        count_ = static_cast<std::int32_t>(count);
        count_latched_ = static_cast<std::int32_t>(latched_);
        position_ = static_cast<double>(count) / by;
        position_latched_ = static_cast<double>(latched_) / by;
        position_interpolated_ = (static_cast<double>(count) + speed_.interpolated()) / by;
        velocity_ = velocity;
        velocity_rpm_ = velocity * 60.0;
    }

    const std::uint16_t control_address_;
    PositionCounter<std::int16_t> counter_;
    EdgeVelocity speed_;
    std::int64_t zero_ = 0;
    std::int64_t latched_ = 0;
    std::uint32_t control_ = 0;
    bool is_read_ = false;
    bool may_have_lost_ = false;
    bool is_uncertain_ = false;  ///< until the count has a new zero
    bool is_done_ = false;  ///< the event that the register shows has been handled
    bool shows_error_ = false;  ///< as quad-error-enable was at the newest answer
    bool has_old_error_ = false;  ///< the register has an error from before that
    bool is_clearing_ = false;  ///< the newest datagram writes the register
    LatchSource source_ = LatchSource::none;  ///< what the register arms

    hal::Out<std::int32_t> count_, rawcounts_, rawlatch_, count_latched_;
    hal::Out<double> position_, position_latched_, position_interpolated_, velocity_, velocity_rpm_;
    hal::Out<bool> quad_error_, position_valid_, input_a_, input_b_, input_index_;
    hal::In<bool> reset_, no_clear_on_index_, quad_error_enable_;
    hal::Io<bool> index_enable_;
    ScaleParam scale_;
    hal::Param<bool> index_invert_, index_mask_, index_mask_invert_, counter_mode_, filter_;
    ValidParam vel_timeout_;
    Placed<Probe> probe_;  ///< of firmware that has one
};

class EncoderPins final : public ModulePins {
public:
    EncoderPins(const PinOwner& o, const CardModule& module, bool has_dpll)
        : addresses_(module.addresses),
          clock_hz_(module.clock_hz),
          divider_(module.addresses.at(encoder::timestamp_divider)),
          filter_(module.addresses.at(encoder::filter)),
          hires_(o.component, o.write, "encoder.hires-timestamp",
                 "TRUE: times of edges in 0.1 us, for periods up to 6 ms; FALSE: in 0.5 us") {
        const bool is_muxed = module.tag() == Tag::muxed_encoder;
        units_ = make_units<Encoder>(o, module);
        frequency_ = place<hal::In<std::uint32_t>>(
            o.component, o.write,
            is_muxed ? "encoder.muxed-sample-frequency" : "encoder.sample-frequency",
            "samples per second of A, B and index",
            hal::PinOptions<std::uint32_t>{.initial = is_muxed ? 8'000'000U : 25'000'000U,
                                           .unit = "Hz"});
        const unsigned version = module.descriptor.version & ~unsigned{encoder::version_with_probe};
        if (is_muxed && version >= encoder::version_with_skew) {
            skew_ = place<hal::In<std::uint32_t>>(
                o.component, o.write, "encoder.muxed-skew",
                "delay of the samples behind the multiplexer, at most 15 clocks of the card",
                hal::PinOptions<std::uint32_t>{.unit = "ns"});
        }
        if (has_dpll) {
            timer_.emplace(o, "encoder.timer-number",
                           "timer of the DPLL that latches counts, 0..4; -1: none",
                           module.addresses.at(encoder::dpll_timer));
        }
    }

    void plan(ReadLayout& layout) override {
        if (units_.empty()) return;
        // the time first: an edge in between must not seem to be in the future
        now_ = layout.add(addresses_.at(encoder::timestamp));
        counts_ = layout.add_instances(addresses_, encoder::count, units_.size());
        controls_ = layout.add_instances(addresses_, encoder::control, units_.size());
    }
    void receive(const Reply& reply, const Reading& reading) noexcept override {
        const auto now = static_cast<std::uint16_t>(reply.at(now_));
        const double hz = timestamp_hz(divider(), clock_hz_);
        for (std::size_t n = 0; n < units_.size(); ++n) {
            units_[n]->receive(reply.word(counts_, n), reply.word(controls_, n), now, hz, reading);
        }
    }
    void transmit(Outgoing& out, const Writing& writing) noexcept override {
        if (units_.empty()) return;
        out.put(divider_, divider());
        std::uint32_t filter = encoder_filter(*frequency_, clock_hz_);
        if (skew_) {
            filter |= encoder_skew(*skew_, clock_hz_) << encoder::skew_shift;
        }
        out.put(filter_, filter);
        if (timer_) {
            timer_->transmit(out);
        }
        for (const auto& unit : units_) {
            unit->transmit(out, writing);
        }
    }

    /// Calls `report(unit)` for each one that may have lost counts in a gap. [realtime]
    template <class Report>
    void take_losses(Report&& report) noexcept {
        report_each(units_, &Encoder::take_loss, report);
    }

private:
    std::uint32_t divider() const noexcept {
        return timestamp_divider(hires_ ? 10e6 : 2e6, clock_hz_);
    }

    const ModuleAddresses addresses_;
    const std::uint32_t clock_hz_;
    Setting divider_, filter_;
    std::vector<Placed<Encoder>> units_;
    hal::In<bool> hires_;
    Placed<hal::In<std::uint32_t>> frequency_;
    Placed<hal::In<std::uint32_t>> skew_;
    std::optional<LatchTimer> timer_;
    std::size_t now_ = 0;
    std::size_t counts_ = 0;
    std::size_t controls_ = 0;
};

}  // namespace hal::mesa
