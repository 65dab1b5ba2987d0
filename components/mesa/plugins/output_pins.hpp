// SPDX-License-Identifier: MIT
// Outputs that are bits of a register: SSR, OutM, LEDs.
#pragma once

#include <algorithm>
#include <vector>

#include "mesa/hostmot2/formulas.hpp"
#include "mesa/hostmot2/registers.hpp"
#include "module_pins.hpp"

namespace hal::mesa {

/// Outputs of one instance of SSR or OutM: those that the card has pins for.
class OutputBits {
public:
    OutputBits(const PinOwner& o, const CardImage& image, Tag tag, unsigned unit,
               const char* prefix) {
        std::vector<unsigned> numbers;
        for (const CardPin& pin : image.pins) {
            const PinDescriptor& d = pin.descriptor;
            const bool is_internal = tag == Tag::ssr && d.number == pin_number::ssr::reference;
            if (d.module != tag || d.unit != unit || is_internal) continue;
            if (d.number == 0 || d.number > 32) continue;
            numbers.push_back(d.number - 1U);
        }
        std::ranges::sort(numbers);
        for (const unsigned number : numbers) {
            outputs_.push_back(place<Output>(o, prefix, unit, number));
        }
    }
    std::uint32_t bits() const noexcept {
        std::uint32_t bits = 0;
        for (const auto& output : outputs_) {
            bits |= output->out != output->invert ? 1U << output->number : 0U;
        }
        return bits;
    }

private:
    struct Output {
        Output(const PinOwner& o, const char* prefix, unsigned unit, unsigned output)
            : number(output),
              out(o.component, o.write, named(prefix, unit, "out", output),
                  "TRUE: the output is on"),
              invert(o.component, o.write, named(prefix, unit, "invert", output),
                     "TRUE: the output is inverted") {}
        const unsigned number;
        hal::In<bool> out, invert;
    };
    static const char* named(const char* prefix, unsigned unit, const char* name, unsigned number) {
        return brief_name("%s.%02u.%s-%02u", prefix, unit, name, number);
    }
    std::vector<Placed<Output>> outputs_;
};

class SsrPins final : public ModulePins {
public:
    SsrPins(const PinOwner& o, const CardImage& image, const CardModule& module)
        : clock_hz_(module.clock_hz) {
        for (unsigned unit = 0; unit < module.used; ++unit) {
            units_.push_back(place<Unit>(o, image, module, unit));
        }
    }
    void transmit(Outgoing& out, const Writing& writing) noexcept override {
        for (const auto& unit : units_) {
            const bool is_on = writing.outputs_on && unit->rate_hz != 0;
            out.put(unit->data, is_on ? unit->bits.bits() : 0);
            out.put(unit->rate, is_on ? ssr_rate(unit->rate_hz, clock_hz_) | ssr::rate_enable : 0);
        }
    }
    void stop(Outgoing& out) const override {
        for (const auto& unit : units_) {
            out.put(unit->data.address(), 0);
            out.put(unit->rate.address(), 0);
        }
    }

private:
    struct Unit {
        Unit(const PinOwner& o, const CardImage& image, const CardModule& module, unsigned unit)
            : data(module.addresses.at(ssr::data, unit)),
              rate(module.addresses.at(ssr::rate, unit)),
              bits(o, image, Tag::ssr, unit, "ssr"),
              rate_hz(o.component, o.write, pin_name("ssr", unit, "rate").c_str(),
                      "internal frequency; 0: the outputs are off",
                      {.initial = 1'000'000, .unit = "Hz"}) {}
        Setting data, rate;
        OutputBits bits;
        hal::In<std::uint32_t> rate_hz;
    };
    const std::uint32_t clock_hz_;
    std::vector<Placed<Unit>> units_;
};

class OutmPins final : public ModulePins {
public:
    OutmPins(const PinOwner& o, const CardImage& image, const CardModule& module) {
        for (unsigned unit = 0; unit < module.used; ++unit) {
            units_.push_back(place<Unit>(o, image, module, unit));
        }
    }
    void transmit(Outgoing& out, const Writing& writing) noexcept override {
        for (const auto& unit : units_) {
            out.put(unit->data, writing.outputs_on ? unit->bits.bits() : 0);
        }
    }
    void stop(Outgoing& out) const override {
        for (const auto& unit : units_) {
            out.put(unit->data.address(), 0);
        }
    }

private:
    struct Unit {
        Unit(const PinOwner& o, const CardImage& image, const CardModule& module, unsigned unit)
            : data(module.addresses.at(outm::data, unit)),
              bits(o, image, Tag::outm, unit, "outm") {}
        Setting data;
        OutputBits bits;
    };
    std::vector<Placed<Unit>> units_;
};

class LedPins final : public ModulePins {
public:
    LedPins(const PinOwner& o, const CardModule& module) : data_(module.addresses.at(led::data)) {
        for (unsigned n = 0; n < module.used; ++n) {
            char name[24];
            std::snprintf(name, sizeof name, "led.CR%02u", n + 1);
            leds_.push_back(place<hal::In<bool>>(o.component, o.write, name, "LED of the card"));
        }
    }
    void transmit(Outgoing& out, const Writing&) noexcept override {
        std::uint32_t bits = 0;
        for (unsigned n = 0; n < leds_.size(); ++n) {
            bits |= *leds_[n] ? 0x8000'0000U >> n : 0U;
        }
        out.put(data_, bits);
    }

private:
    Setting data_;
    std::vector<Placed<hal::In<bool>>> leds_;
};

}  // namespace hal::mesa
