// SPDX-License-Identifier: MIT
// I/O pins: the free ones as gpio.NNN, and the levels of those that modules use.
#pragma once

#include <memory>
#include <vector>

#include "mesa/hostmot2/pin.hpp"
#include "mesa/hostmot2/registers.hpp"
#include "module_pins.hpp"

namespace hal::mesa {

/// One I/O pin. A pin that a module uses as an output has the parameters of its driver twice: as
/// gpio.NNN and with the name of the module, as in LinuxCNC, where the second is an alias.
class PortPin {
public:
    PortPin(const PinOwner& o, unsigned number, const CardPin& pin)
        : is_module_output_(pin.is_module_output()),
          in_(o.component, o.read, named(number, "in"), "level of the pin"),
          in_not_(o.component, o.read, named(number, "in_not"), "level of the pin, inverted") {
        if (pin.is_gpio) {
            out_ = std::make_unique<hal::In<bool>>(o.component, o.write, named(number, "out"),
                                                   "level of the output");
            is_output_ = parameter(o, named(number, "is_output"), "TRUE: the pin is an output");
        }
        if (pin.is_gpio || is_module_output_) {
            open_drain_ = parameter(o, named(number, "is_opendrain"),
                                    "TRUE: an output of TRUE leaves the pin floating");
            invert_ = parameter(o, named(number, "invert_output"), "TRUE: the output is inverted");
        }
        if (is_module_output_) {
            const std::string function = function_of(pin.descriptor);
            if (function.empty()) return;
            open_drain_alias_ = parameter(o, (function + ".is_opendrain").c_str(),
                                          "TRUE: an output of TRUE leaves the pin floating");
            invert_alias_ =
                parameter(o, (function + ".invert_output").c_str(), "TRUE: the output is inverted");
        }
    }

    bool is_output() const noexcept { return is_module_output_ || is_true(is_output_); }
    bool is_module_output() const noexcept { return is_module_output_; }
    bool is_open_drain() const noexcept {
        return is_output() && (is_true(open_drain_) || is_true(open_drain_alias_));
    }
    bool is_inverted() const noexcept { return is_true(invert_) || is_true(invert_alias_); }
    bool level() const noexcept { return out_ && *out_; }
    void show(bool level) noexcept {
        in_ = level;
        in_not_ = !level;
    }

private:
    using Parameter = std::unique_ptr<hal::Param<bool>>;

    static const char* named(unsigned number, const char* name) {
        return brief_name("gpio.%03u.%s", number, name);
    }
    static Parameter parameter(const PinOwner& o, const char* name, const char* doc) {
        return std::make_unique<hal::Param<bool>>(o.component, name, doc);
    }
    static bool is_true(const Parameter& parameter) noexcept { return parameter && *parameter; }

    const bool is_module_output_;
    hal::Out<bool> in_, in_not_;
    std::unique_ptr<hal::In<bool>> out_;
    Parameter is_output_, open_drain_, invert_, open_drain_alias_, invert_alias_;
};

class PortPins final : public ModulePins {
public:
    PortPins(const PinOwner& o, const CardImage& image, const CardModule& module)
        : addresses_(module.addresses), ports_(image.idrom.ports), width_(image.idrom.port_width) {
        for (unsigned n = 0; n < image.pins.size(); ++n) {
            pins_.push_back(std::make_unique<PortPin>(o, n, image.pins[n]));
        }
        for (unsigned port = 0; port < ports_; ++port) {
            registers_.emplace_back(addresses_, port);
            registers_.back().module_outputs = bits_of(port).source;
        }
    }

    void plan(ReadLayout& layout) override {
        levels_ = layout.add_instances(addresses_, ioport::data, ports_);
    }
    void receive(const Reply& reply, const Reading& reading) noexcept override {
        for (Registers& r : registers_) {
            r.open_drain.receive(reading.writes_arrived);
            r.direction.receive(reading.writes_arrived);
        }
        for (std::size_t n = 0; n < pins_.size(); ++n) {
            pins_[n]->show((reply.word(levels_, n / width_) >> n % width_ & 1U) != 0);
        }
    }
    void miss(double) noexcept override {
        for (Registers& r : registers_) {
            r.open_drain.miss();
            r.direction.miss();
        }
    }
    /// Returns whether the card has the pins of modules as outputs, as an answer has shown.
    /// [realtime]
    bool modules_are_released() const noexcept {
        for (unsigned port = 0; port < ports_; ++port) {
            if ((registers_[port].module_outputs & ~registers_[port].direction.confirmed()) != 0) return false;
        }
        return true;
    }
    /// The direction is the last, so that an output begins with its level.
    void transmit(Outgoing& out, const Writing& writing) noexcept override {
        for (unsigned port = 0; port < ports_; ++port) {
            Bits bits = bits_of(port);
            if (!writing.outputs_on) {
                bits.direction = 0;
                bits.open_drain = 0;
            }
            Registers& r = registers_[port];
            out.put(r.data, bits.data);
            out.put(r.source, bits.source);
            out.put(r.invert, bits.invert);
            r.open_drain.transmit(out, bits.open_drain, writing.may_set_outputs);
            r.direction.transmit(out, bits.direction, writing.may_set_outputs);
        }
    }
    void stop(Outgoing& out) const override {
        for (const Registers& r : registers_) {
            out.put(r.direction.address(), 0);
            out.put(r.open_drain.address(), 0);
        }
    }
    void has_stopped() noexcept override {
        for (Registers& r : registers_) {
            r.open_drain.forget();
            r.direction.forget();
        }
    }

private:
    struct Bits {
        std::uint32_t data = 0, direction = 0, source = 0, open_drain = 0, invert = 0;
    };
    struct Registers {
        Registers(const ModuleAddresses& a, unsigned port)
            : data(a.at(ioport::data, port)),
              source(a.at(ioport::source, port)),
              invert(a.at(ioport::invert, port)),
              direction(a.at(ioport::direction, port)),
              open_drain(a.at(ioport::open_drain, port)) {}
        Setting data, source, invert;
        PinSwitch direction, open_drain;
        std::uint32_t module_outputs = 0;  ///< bit per pin
    };

    Bits bits_of(unsigned port) const noexcept {
        Bits bits;
        for (unsigned n = 0; n < width_ && port * width_ + n < pins_.size(); ++n) {
            const PortPin& pin = *pins_[port * width_ + n];
            const std::uint32_t bit = 1U << n;
            bits.data |= pin.level() ? bit : 0;
            bits.direction |= pin.is_output() ? bit : 0;
            bits.source |= pin.is_module_output() ? bit : 0;
            bits.open_drain |= pin.is_open_drain() ? bit : 0;
            bits.invert |= pin.is_inverted() ? bit : 0;
        }
        return bits;
    }

    const ModuleAddresses addresses_;
    const unsigned ports_, width_;
    std::vector<std::unique_ptr<PortPin>> pins_;
    std::vector<Registers> registers_;
    std::size_t levels_ = 0;
};

}  // namespace hal::mesa
