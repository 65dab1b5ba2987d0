// SPDX-License-Identifier: MIT
#include <array>
#include <cstddef>
#include <optional>
#include <string>

#include "hal/component.hpp"

namespace {

constexpr std::array out_pins = {1, 2, 3, 4, 5, 6, 7, 8, 9, 14, 16, 17};
constexpr std::array in_pins = {2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 15};

struct SimParport : hal::Component {
    hal::Function read_function{*this, "read", &SimParport::read,
                                "copies the -in-fake pins to the inputs"};
    hal::Function write_function{*this, "write", &SimParport::write,
                                 "copies the outputs to the -out-fake pins"};
    hal::Function reset_function{*this, "reset", &SimParport::reset,
                                 "no effect; the real port ends its pulses here"};

    struct Output {
        std::optional<hal::In<bool>> pin;
        std::optional<hal::Out<bool>> fake;
        std::optional<hal::Param<bool>> invert, reset;
    };
    struct Input {
        std::optional<hal::Out<bool>> pin, inverted;
        std::optional<hal::In<bool>> fake;
    };
    std::array<Output, out_pins.size()> outputs;
    std::array<Input, in_pins.size()> inputs;
    hal::In<double> reset_time{*this,
                               read_function,
                               "reset-time",
                               "no effect; the length of the real port's pulses",
                               {.unit = "ns"}};

    explicit SimParport(const hal_host* host) : Component(host) {
        for (std::size_t i = 0; i < out_pins.size(); ++i) {
            const std::string name = numbered(out_pins[i]) + "-out";
            Output& o = outputs[i];
            o.pin.emplace(*this, write_function, name.c_str(), "output of the port");
            o.fake.emplace(*this, write_function, (name + "-fake").c_str(), "follows the output");
            o.invert.emplace(*this, write_function, (name + "-invert").c_str(),
                             "TRUE inverts the output");
            o.reset.emplace(*this, write_function, (name + "-reset").c_str(),
                            "no effect; the real port resets the output after a pulse");
        }
        for (std::size_t i = 0; i < in_pins.size(); ++i) {
            const std::string name = numbered(in_pins[i]) + "-in";
            Input& in = inputs[i];
            in.fake.emplace(*this, read_function, (name + "-fake").c_str(),
                            "simulated level of the input");
            in.pin.emplace(*this, read_function, name.c_str(), "input of the port");
            in.inverted.emplace(*this, read_function, (name + "-not").c_str(), "input, inverted");
        }
    }

    void read(hal::Cycle) noexcept {
        for (Input& in : inputs) {
            *in.pin = in.fake->get();
            *in.inverted = !*in.fake;
        }
    }
    void write(hal::Cycle) noexcept {
        for (Output& o : outputs) {
            *o.fake = o.pin->get() != o.invert->get();
        }
    }
    void reset(hal::Cycle) noexcept {}

private:
    static std::string numbered(int number) {
        return (number < 10 ? "pin-0" : "pin-") + std::to_string(number);
    }
};

}  // namespace

HAL_COMPONENT(SimParport, "sim_parport", "Simulated parallel port", R"(
Has all pins of `hal_parport` for both directions, with the same names, and for each a `-fake` pin
for the outside: `pin-02-in` follows `pin-02-in-fake`, `pin-01-out-fake` follows `pin-01-out`,
inverted by `pin-01-out-invert`. Load it under the port's name; the rest of the netlist needs no
change.

    loadrt sim_parport names=parport.0
    addf parport.0.read base-thread
    addf parport.0.write base-thread
    net estop => parport.0.pin-10-in-fake
    net step  => parport.0.pin-02-out
)")
