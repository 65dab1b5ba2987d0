// SPDX-License-Identifier: MIT
// The phase-locked loop of the card, and raw access to registers.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "mesa/hostmot2/formulas.hpp"
#include "mesa/hostmot2/registers.hpp"
#include "module_pins.hpp"
#include "valid_pin.hpp"

namespace hal::mesa {

/// Negative is that of the thread. Without bounds the loop would stand, or run at its highest rate.
inline constexpr ValueRule frequency_value{[](double khz) noexcept {
    return std::isfinite(khz) && (khz < 0.0 || (khz >= 1e-3 && khz <= 1e3));
}, " is 0, NaN, infinite, below 0.001 or above 1000; "};

/// Its timers latch positions at a fixed time before the reading. Reading the sync register is the
/// event that it locks to. `leads`: it runs freely, and the threads follow it.
class DpllPins final : public ModulePins {
public:
    DpllPins(const PinOwner& o, const CardModule& module, bool leads)
        : clock_hz_(module.clock_hz),
          leads_(leads),
          sync_address_(module.addresses.at(dpll::sync)),
          control_1_address_(module.addresses.at(dpll::control_1)),
          base_(module.addresses.at(dpll::base_rate)),
          preset_address_(module.addresses.at(dpll::phase_preset)),
          control_0_(module.addresses.at(dpll::control_0)),
          control_1_(module.addresses.at(dpll::control_1)),
          timers_1_2_(module.addresses.at(dpll::timers_1_2)),
          timers_3_4_(module.addresses.at(dpll::timers_3_4)),
          base_freq_khz_(o.component, o.write, "dpll.base-freq-khz",
                         "frequency; negative: that of the thread", frequency_value,
                         {.initial = -1.0, .unit = "kHz"}),
          time_const_(o.component, o.write, "dpll.time-const", "time constant of the loop filter",
                      {.initial = 2000}),
          plimit_(o.component, o.write, "dpll.plimit", "limit of a correction; 0: it runs freely",
                  {.initial = 0x40'0000}),
          phase_error_us_(o.component, o.read, "dpll.phase-error-us",
                          "phase of the reading in the period of the loop", {.unit = "us"}),
          ddsize_(o.component, o.read, "dpll.ddsize", "bits of the phase accumulator"),
          prescale_(o.component, "dpll.prescale", "divider of its clock; it is computed",
                    {.initial = 1}) {
        for (unsigned n = 1; n <= 4; ++n) {
            timer_us_.push_back(place<ValidIn>(
                o.component, o.write, pin_name("dpll", n, "timer-us").c_str(),
                "when the timer latches, after the reading; negative: before it; at the reading "
                "where that is not within a period",
                finite_value, hal::PinOptions<double>{.initial = 100.0, .unit = "us"}));
        }
    }

    void plan(ReadLayout& layout) override {
        sync_ = layout.add(sync_address_);
        size_ = layout.add(control_1_address_);
    }
    void receive(const Reply& reply, const Reading& reading) noexcept override {
        error_us_ = dpll_phase_us(reply.at(sync_), reading.period_s * 1e6);
        phase_error_us_ = error_us_;
        ddsize_ = reply.at(size_) & 0xffU;
        is_known_ = true;
        presets_ = reading.has_lost_power ? preset_cycles : presets_;
    }
    void transmit(Outgoing& out, const Writing& writing) noexcept override {
        if (!is_known_) return;
        const double period_us = writing.period_s * 1e6;
        const double khz = base_freq_khz_;
        const double hz = khz > 0.0 ? khz * 1e3 : 1.0 / writing.period_s;
        const DpllRate rate = dpll_rate(hz, ddsize_, clock_hz_);
        prescale_ = rate.prescale;
        const std::uint32_t limit = leads_ ? 0 : plimit_.get() & 0xff'ffffU;
        out.put(base_, rate.base);
        out.put(control_0_, rate.prescale << 24 | limit);
        out.put(control_1_, std::min<std::uint32_t>(time_const_, 0xffff) << 16);
        out.put(timers_1_2_, pair(0, period_us));
        out.put(timers_3_4_, pair(2, period_us));
        // the loop begins at the phase of the thread, and does not have to run there
        if (presets_ > 0) {
            --presets_;
            out.put(preset_address_, 0);
        }
    }
    double error_us() const noexcept { return error_us_; }
    /// Returns how long before the reading a timer has latched, s; 0 for -1 (none) and 0. One that
    /// latches after the reading has done so in the period before. [realtime]
    double latched_before_s(std::int32_t timer, double period_s) const noexcept {
        if (timer < 1 || timer > 4) return 0.0;
        const double after_s = *timer_us_[static_cast<std::size_t>(timer - 1)] * 1e-6;
        if (!(std::abs(after_s) <= period_s)) return 0.0;
        return after_s > 0.0 ? period_s - after_s : -after_s;
    }

private:
    static constexpr unsigned preset_cycles = 100;

    std::uint32_t pair(unsigned first, double period_us) const noexcept {
        const std::uint32_t low = dpll_timer(*timer_us_[first], period_us);
        const std::uint32_t high = dpll_timer(*timer_us_[first + 1], period_us);
        return low | high << 16;
    }

    const std::uint32_t clock_hz_;
    const bool leads_;
    const std::uint16_t sync_address_, control_1_address_;
    Setting base_;
    const std::uint16_t preset_address_;
    Setting control_0_, control_1_, timers_1_2_, timers_3_4_;
    std::vector<Placed<ValidIn>> timer_us_;
    ValidIn base_freq_khz_;
    hal::In<std::uint32_t> time_const_, plimit_;
    hal::Out<double> phase_error_us_;
    hal::Out<std::uint32_t> ddsize_;
    hal::Io<std::uint32_t> prescale_;
    std::size_t sync_ = 0;
    std::size_t size_ = 0;
    double error_us_ = 0.0;
    bool is_known_ = false;
    unsigned presets_ = preset_cycles;
};

/// Any register, for experiments.
class RawPins final : public ModulePins {
public:
    explicit RawPins(const PinOwner& o)
        : read_address_(o.component, o.write, "raw.read_address", "register to be read"),
          read_data_(o.component, o.read, "raw.read_data", "its value"),
          write_address_(o.component, o.write, "raw.write_address", "register to be written"),
          write_data_(o.component, o.write, "raw.write_data", "its new value"),
          write_strobe_(o.component, "raw.write_strobe",
                        "TRUE: writes it once, and becomes FALSE") {}
    void plan(ReadLayout& layout) override { data_ = layout.add_at(address_); }
    void receive(const Reply& reply, const Reading&) noexcept override {
        read_data_ = reply.at(data_);
    }
    void transmit(Outgoing& out, const Writing&) noexcept override {
        address_ = static_cast<std::uint16_t>(read_address_ & 0xfffcU);
        if (!write_strobe_) return;
        out.put(static_cast<std::uint16_t>(write_address_ & 0xffffU), write_data_);
        write_strobe_ = false;
    }

private:
    hal::In<std::uint32_t> read_address_;
    hal::Out<std::uint32_t> read_data_;
    hal::In<std::uint32_t> write_address_, write_data_;
    hal::Io<bool> write_strobe_;
    std::uint16_t address_ = 0;
    std::size_t data_ = 0;
};

}  // namespace hal::mesa
