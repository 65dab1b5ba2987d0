// SPDX-License-Identifier: MIT
// PWM generators.
#pragma once

#include <cmath>
#include <vector>

#include "mesa/hostmot2/formulas.hpp"
#include "mesa/hostmot2/registers.hpp"
#include "module_pins.hpp"
#include "scale_param.hpp"

namespace hal::mesa {

class PwmGenerator {
public:
    PwmGenerator(const PinOwner& o, unsigned unit, const CardModule& module)
        : value_address_(module.addresses.at(pwm::value, unit)),
          mode_(module.addresses.at(pwm::mode, unit)),
          has_dither_(module.descriptor.version >= 1),
          value_(o.component, o.write, named(unit, "value"), "commanded value"),
          enable_(o.component, o.write, named(unit, "enable"), "TRUE: the output is on"),
          offset_mode_(o.component, o.write, named(unit, "offset-mode"),
                       "TRUE: a value of 0 is a duty cycle of 50 %"),
          dither_(o.component, o.write, named(unit, "dither"),
                  "TRUE: finer steps by alternating between two values, where the firmware can"),
          scale_(o.component, named(unit, "scale"), "value at a duty cycle of 100 %",
                 {.initial = 1.0}),
          output_type_(o.component, named(unit, "output-type"),
                       "1: PWM and direction, 2: up and down, 3: PDM and direction, 4: direction "
                       "and PWM",
                       {.initial = 1}) {}

    /// `bits`: resolution of PWM. Returns whether the output is on. [realtime] write
    bool transmit(Outgoing& out, const Writing& writing, unsigned bits) noexcept {
        const bool is_on = writing.outputs_on && enable_;
        const bool is_pdm = output_type_ == 3;
        const unsigned used_bits = is_pdm ? 12 : bits;
        out.put(mode_, mode(used_bits));
        out.put(value_address_, is_on ? pwm_value(duty(), used_bits) : 0);
        return is_on;
    }
    /// [setup]
    void stop(Outgoing& out) const { out.put(value_address_, 0); }

private:
    static const char* named(unsigned unit, const char* name) {
        return brief_name("pwmgen.%02u.%s", unit, name);
    }
    double duty() const noexcept {
        const double by = scale_;
        double duty = value_ / by;
        if (!std::isfinite(duty)) return 0.0;
        duty = std::clamp(duty, -1.0, 1.0);
        return offset_mode_ ? (duty + 1.0) / 2.0 : duty;
    }
    std::uint32_t mode(unsigned bits) const noexcept {
        pwm::Output output = pwm::Output::direction;
        switch (output_type_.get()) {
        case 2: output = pwm::Output::up_down; break;
        case 3: output = pwm::Output::pdm; break;
        case 4: output = pwm::Output::swapped; break;
        default: break;
        }
        std::uint32_t mode = (bits - 9) | static_cast<std::uint32_t>(output) << 3;
        mode |= output == pwm::Output::pdm ? 0 : pwm::double_buffered;
        mode |= dither_ && has_dither_ && output != pwm::Output::pdm ? pwm::dither : 0;
        return mode;
    }

    const std::uint16_t value_address_;
    Setting mode_;
    const bool has_dither_;
    hal::In<double> value_;
    hal::In<bool> enable_, offset_mode_, dither_;
    ScaleParam scale_;
    hal::Param<std::int32_t> output_type_;
};

class PwmPins final : public ModulePins {
public:
    PwmPins(const PinOwner& o, const CardModule& module)
        : clock_hz_(module.clock_hz),
          pwm_rate_(module.addresses.at(pwm::pwm_rate)),
          pdm_rate_(module.addresses.at(pwm::pdm_rate)),
          enables_(module.addresses.at(pwm::enables)),
          pwm_frequency_(o.component, "pwmgen.pwm_frequency", "frequency of PWM",
                         {.initial = 20'000, .unit = "Hz"}),
          pdm_frequency_(o.component, "pwmgen.pdm_frequency", "pulses per second of PDM",
                         {.initial = 20'000, .unit = "Hz"}) {
        units_ = make_units<PwmGenerator>(o, module);
    }

    void transmit(Outgoing& out, const Writing& writing) noexcept override {
        if (units_.empty()) return;
        const PwmRate rate = hal::mesa::pwm_rate(pwm_frequency_, clock_hz_);
        out.put(pwm_rate_, rate.rate);
        out.put(pdm_rate_, hal::mesa::pdm_rate(pdm_frequency_, clock_hz_));
        std::uint32_t enables = 0;
        for (std::size_t n = 0; n < units_.size(); ++n) {
            const bool is_on = units_[n]->transmit(out, writing, rate.bits);
            enables |= is_on ? 1U << n : 0U;
        }
        out.put(enables_, enables);
    }
    void stop(Outgoing& out) const override {
        for (const auto& unit : units_) {
            unit->stop(out);
        }
        if (!units_.empty()) {
            out.put(enables_.address(), 0);
        }
    }

private:
    const std::uint32_t clock_hz_;
    Setting pwm_rate_, pdm_rate_, enables_;
    std::vector<Placed<PwmGenerator>> units_;
    hal::Param<std::uint32_t> pwm_frequency_, pdm_frequency_;
};

}  // namespace hal::mesa
