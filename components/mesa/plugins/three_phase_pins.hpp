// SPDX-License-Identifier: MIT
// Three-phase PWM: the six gates of a motor bridge.
#pragma once

#include <algorithm>
#include <vector>

#include "command_pin.hpp"
#include "mesa/driver/bridge_enable.hpp"
#include "mesa/hostmot2/formulas.hpp"
#include "mesa/hostmot2/registers.hpp"
#include "module_pins.hpp"
#include "scale_param.hpp"
#include "valid_pin.hpp"

namespace hal::mesa {

class ThreePhaseGenerator {
public:
    ThreePhaseGenerator(const PinOwner& o, unsigned unit, const CardModule& module)
        : clock_hz_(module.clock_hz),
          value_address_(module.addresses.at(three_phase_pwm::value, unit)),
          enable_address_(module.addresses.at(three_phase_pwm::enable, unit)),
          setup_(module.addresses.at(three_phase_pwm::setup, unit)),
          a_(o, named(unit, "A-value"), "command of phase A", reaction),
          b_(o, named(unit, "B-value"), "command of phase B", reaction),
          c_(o, named(unit, "C-value"), "command of phase C", reaction),
          enable_(o.component, o.write, named(unit, "enable"),
                  "TRUE: the bridge is on, unless the fault input has switched it off; FALSE, then "
                  "TRUE: on again after a fault"),
          fault_(o.component, o.read, named(unit, "fault"),
                 "the fault input has switched the bridge off", {.safe = false}),
          scale_(o.component, named(unit, "scale"), "command of a duty cycle of 100 %",
                 {.initial = 1.0}),
          dead_time_(o.component, named(unit, "deadtime"),
                     "time between the two gates of a phase: none of them is on", time_value,
                     {.initial = 5000.0, .unit = "ns"}),
          fault_invert_(o.component, named(unit, "fault-invert"),
                        "FALSE: the fault input is active low; TRUE: active high"),
          sample_time_(o.component, named(unit, "sample-time"),
                       "time of the sampling pulse: 0 start of a PWM cycle, 1 its end",
                       finite_value, {.initial = 0.5}) {}

    /// [realtime] read
    void receive(std::uint32_t enable, const Reading& reading) noexcept {
        bridge_.receive(enable, reading.writes_arrived);
        fault_ = (enable & three_phase_pwm::has_fault) != 0 || bridge_.is_tripped();
    }
    /// `rate`: that of all generators. [realtime] write
    void transmit(Outgoing& out, const Writing& writing, std::uint32_t rate) noexcept {
        std::uint32_t setup = three_phase_dead_time(dead_time_, rate, clock_hz_);
        setup |= fault_invert_ ? three_phase_pwm::fault_on_high : 0;
        setup |= three_phase_sample(sample_time_) << three_phase_pwm::sample_shift;
        out.put(setup_, setup);
        out.put(value_address_, value());
        // without a frequency the gates would keep their levels
        if (const auto enable = bridge_.transmit(enable_, writing.outputs_on && rate != 0)) {
            out.put(enable_address_, *enable);
        }
    }
    /// [setup]
    void stop(Outgoing& out) const { out.put(enable_address_, 0); }

private:
    static const char* named(unsigned unit, const char* name) {
        return brief_name("3pwmgen.%02u.%s", unit, name);
    }
    /// Without one of the commands no phase has a voltage against another.
    std::uint32_t value() noexcept {
        const double by = scale_;
        if (!enable_) {
            a_.ignore();
            b_.ignore();
            c_.ignore();
            return three_phase_value(0.0, 0.0, 0.0);
        }
        const auto a = a_.valid();
        const auto b = b_.valid();
        const auto c = c_.valid();
        if (!a || !b || !c) return three_phase_value(0.0, 0.0, 0.0);
        const auto duty = [by](double command) { return std::clamp(command / by, -1.0, 1.0); };
        return three_phase_value(duty(*a), duty(*b), duty(*c));
    }
    static constexpr const char* reaction = "all phases have a duty cycle of 50 %";

    const std::uint32_t clock_hz_;
    const std::uint16_t value_address_, enable_address_;
    Setting setup_;
    BridgeEnable bridge_;
    CommandPin a_, b_, c_;
    hal::In<bool> enable_;
    hal::Out<bool> fault_;
    ScaleParam scale_;
    ValidParam dead_time_;
    hal::Param<bool> fault_invert_;
    ValidParam sample_time_;
};

class ThreePhasePins final : public ModulePins {
public:
    ThreePhasePins(const PinOwner& o, const CardModule& module)
        : addresses_(module.addresses),
          clock_hz_(module.clock_hz),
          rate_(module.addresses.at(three_phase_pwm::rate)),
          units_(make_units<ThreePhaseGenerator>(o, module)),
          frequency_(o.component, "3pwmgen.frequency", "frequency of PWM; 0: the bridges are off",
                     {.initial = 20'000, .unit = "Hz"}) {}

    void plan(ReadLayout& layout) override {
        enables_ = layout.add_instances(addresses_, three_phase_pwm::enable, units_.size());
    }
    void receive(const Reply& reply, const Reading& reading) noexcept override {
        for (std::size_t n = 0; n < units_.size(); ++n) {
            units_[n]->receive(reply.word(enables_, n), reading);
        }
    }
    void transmit(Outgoing& out, const Writing& writing) noexcept override {
        const std::uint32_t rate = three_phase_rate(frequency_, clock_hz_);
        out.put(rate_, rate);
        for (const auto& unit : units_) {
            unit->transmit(out, writing, rate);
        }
    }
    void stop(Outgoing& out) const override {
        for (const auto& unit : units_) {
            unit->stop(out);
        }
    }

private:
    const ModuleAddresses addresses_;
    const std::uint32_t clock_hz_;
    Setting rate_;
    std::vector<Placed<ThreePhaseGenerator>> units_;
    hal::Param<std::uint32_t> frequency_;
    std::size_t enables_ = 0;
};

}  // namespace hal::mesa
