// SPDX-License-Identifier: MIT
// PWM generators.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "command_pin.hpp"
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
          value_(o, named(unit, "value"), "commanded value", "the output is off"),
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

    /// Rates of all generators.
    struct Rates {
        PwmRate pwm;
        std::uint32_t pdm = 0;
    };
    /// Returns whether the output is on. [realtime] write
    bool transmit(Outgoing& out, const Writing& writing, const Rates& rates) noexcept {
        const bool is_pdm = output_type_ == 3;
        const unsigned bits = is_pdm ? 12 : rates.pwm.bits;
        const std::optional<double> duty = wanted_duty(writing);
        // without a frequency the output would keep its level
        const bool has_rate = (is_pdm ? rates.pdm : rates.pwm.rate) != 0;
        const bool is_on = duty.has_value() && has_rate;
        out.put(mode_, mode(bits));
        out.put(value_address_, is_on ? pwm_value(*duty, bits) : 0);
        return is_on;
    }
    /// [setup]
    void stop(Outgoing& out) const { out.put(value_address_, 0); }

private:
    static const char* named(unsigned unit, const char* name) {
        return brief_name("pwmgen.%02u.%s", unit, name);
    }
    /// Returns the duty cycle; nothing: the output is off.
    std::optional<double> wanted_duty(const Writing& writing) noexcept {
        const double by = scale_;
        if (!writing.outputs_on || !enable_) {
            value_.ignore();
            return {};
        }
        const std::optional<double> value = value_.valid();
        if (!value) return {};
        const double duty = std::clamp(*value / by, -1.0, 1.0);
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
    CommandPin value_;
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
          pwm_frequency_(o.component, "pwmgen.pwm_frequency",
                         "frequency of PWM; 0: the outputs are off",
                         {.initial = 20'000, .unit = "Hz"}),
          pdm_frequency_(o.component, "pwmgen.pdm_frequency",
                         "pulses per second of PDM; 0: the outputs are off",
                         {.initial = 20'000, .unit = "Hz"}) {
        units_ = make_units<PwmGenerator>(o, module);
    }

    void transmit(Outgoing& out, const Writing& writing) noexcept override {
        if (units_.empty()) return;
        const PwmGenerator::Rates rates{hal::mesa::pwm_rate(pwm_frequency_, clock_hz_),
                                        hal::mesa::pdm_rate(pdm_frequency_, clock_hz_)};
        out.put(pwm_rate_, rates.pwm.rate);
        out.put(pdm_rate_, rates.pdm);
        std::uint32_t enables = 0;
        for (std::size_t n = 0; n < units_.size(); ++n) {
            const bool is_on = units_[n]->transmit(out, writing, rates);
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
