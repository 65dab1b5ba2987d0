// SPDX-License-Identifier: MIT
// I/O pins: the free ones as gpio.NNN, and the levels of those that modules use.
#pragma once

#include <bit>
#include <optional>
#include <string>
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
            out_.emplace(o.component, o.write, named(number, "out"), "level of the output");
            is_output_.emplace(o.component, named(number, "is_output"),
                               "TRUE: the pin is an output");
        }
        if (pin.is_gpio || is_module_output_) {
            open_drain_.emplace(o.component, named(number, "is_opendrain"), open_drain_doc);
            invert_.emplace(o.component, named(number, "invert_output"), invert_doc);
        }
        if (is_module_output_) {
            const std::string function = function_of(pin.descriptor);
            if (function.empty()) return;
            open_drain_alias_.emplace(o.component, (function + ".is_opendrain").c_str(),
                                      open_drain_doc);
            invert_alias_.emplace(o.component, (function + ".invert_output").c_str(), invert_doc);
        }
    }

    bool is_output() const noexcept { return is_module_output_ || is_true(is_output_); }
    bool is_module_output() const noexcept { return is_module_output_; }
    /// The rest is that of an output.
    bool is_open_drain() const noexcept {
        return is_true(open_drain_) || is_true(open_drain_alias_);
    }
    bool is_inverted() const noexcept { return is_true(invert_) || is_true(invert_alias_); }
    bool level() const noexcept { return out_ && *out_; }
    void show(bool level) noexcept {
        in_ = level;
        in_not_ = !level;
    }

private:
    using Parameter = std::optional<hal::Param<bool>>;
    static constexpr const char* open_drain_doc = "TRUE: an output of TRUE leaves the pin floating";
    static constexpr const char* invert_doc = "TRUE: the output is inverted";

    static const char* named(unsigned number, const char* name) {
        return brief_name("gpio.%03u.%s", number, name);
    }
    static bool is_true(const Parameter& parameter) noexcept { return parameter && *parameter; }

    const bool is_module_output_;
    hal::Out<bool> in_, in_not_;
    std::optional<hal::In<bool>> out_;
    Parameter is_output_, open_drain_, invert_, open_drain_alias_, invert_alias_;
};

class PortPins final : public ModulePins {
public:
    PortPins(const PinOwner& o, const CardImage& image, const CardModule& module)
        : addresses_(module.addresses), ports_(image.idrom.ports), width_(image.idrom.port_width) {
        for (unsigned n = 0; n < image.pins.size(); ++n) {
            pins_.push_back(place<PortPin>(o, n, image.pins[n]));
        }
        for (unsigned port = 0; port < ports_; ++port) {
            registers_.emplace_back(addresses_, port);
            registers_.back().module_outputs = bits_of(port).source;
        }
    }

    void plan(ReadLayout& layout) override {
        levels_ = layout.add_instances(addresses_, ioport::data, ports_);
        directions_ = layout.add_instances(addresses_, ioport::direction, ports_);
    }
    void receive(const Reply& reply, const Reading& reading) noexcept override {
        for (Registers& r : registers_) {
            r.open_drain.receive(reading.writes_arrived);
            r.direction.receive(reading.writes_arrived);
        }
        for (unsigned port = 0; port < ports_; ++port) {
            show(port, reply.word(levels_, port), reading.is_after_gap);
        }
    }
    void miss(double) noexcept override {
        for (Registers& r : registers_) {
            r.open_drain.miss();
            r.direction.miss();
        }
    }
    /// Returns whether an answer without a bite or a reset shows other directions than those that
    /// were written. A card counts as one that shows them when it has done so. [realtime] read
    bool were_changed(const Reply& reply, bool writes_arrived) noexcept {
        bool differs = false;
        bool agrees = false;
        for (unsigned port = 0; port < ports_; ++port) {
            const auto expected = registers_[port].direction.expected(writes_arrived);
            if (!expected) continue;
            const bool is_same = reply.word(directions_, port) == *expected;
            differs = differs || !is_same;
            agrees = agrees || (is_same && *expected != 0);
        }
        const bool shows_directions = shows_directions_;
        shows_directions_ = shows_directions_ || agrees;
        return differs && shows_directions;
    }
    /// Returns whether the card has the pins of modules as outputs, as an answer has shown.
    /// [realtime]
    bool modules_are_released() const noexcept {
        for (unsigned port = 0; port < ports_; ++port) {
            if ((registers_[port].module_outputs & ~registers_[port].direction.confirmed()) != 0)
                return false;
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
        std::uint32_t shown = 0;  ///< levels
        bool is_shown = false;
    };

    /// Shows the levels of a port: of the pins that have changed, or of all.
    void show(unsigned port, std::uint32_t levels, bool all) noexcept {
        Registers& r = registers_[port];
        std::uint32_t changed = all || !r.is_shown ? ~0U : levels ^ r.shown;
        r.shown = levels;
        r.is_shown = true;
        changed &= ~0U >> (32 - width_);
        for (; changed != 0; changed &= changed - 1) {
            const auto n = static_cast<unsigned>(std::countr_zero(changed));
            pins_[port * width_ + n]->show((levels >> n & 1U) != 0);
        }
    }
    Bits bits_of(unsigned port) const noexcept {
        Bits bits;
        for (unsigned n = 0; n < width_ && port * width_ + n < pins_.size(); ++n) {
            const PortPin& pin = *pins_[port * width_ + n];
            if (!pin.is_output()) continue;  // level and inversion are those of outputs
            const std::uint32_t bit = 1U << n;
            bits.direction |= bit;
            bits.data |= pin.level() ? bit : 0;
            bits.source |= pin.is_module_output() ? bit : 0;
            bits.open_drain |= pin.is_open_drain() ? bit : 0;
            bits.invert |= pin.is_inverted() ? bit : 0;
        }
        return bits;
    }

    const ModuleAddresses addresses_;
    const unsigned ports_, width_;
    std::vector<Placed<PortPin>> pins_;
    std::vector<Registers> registers_;
    std::size_t levels_ = 0;
    std::size_t directions_ = 0;
    bool shows_directions_ = false;  ///< its registers can be read
};

}  // namespace hal::mesa
