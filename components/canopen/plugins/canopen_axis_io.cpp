// SPDX-License-Identifier: MIT
#include <deque>

#include "canopen/device/component.hpp"
#include "canopen/device/drive/axis_io.hpp"

namespace {

using namespace hal::canopen;

struct CanopenAxisIo final : NodeComponent {
    explicit CanopenAxisIo(const hal_host* host) : NodeComponent(host, 2) {
        auto made = make_plant(plant.get());
        if (!made) {
            throw std::invalid_argument("plant=" + std::string(plant.get()) +
                                        ": unknown plant; use one of: " + plant_names);
        }
        for (const auto& row : made->influences()) {
            const hal::PinOptions<double> number{.initial = row.initial, .unit = row.unit};
            switch (row.kind) {
            case Influence::value: values_.emplace_back(*this, row.name, row.doc, number); break;
            case Influence::tap: taps_.emplace_back(*this, row.name, row.doc, number); break;
            case Influence::flag:
                flags_.emplace_back(*this, row.name, row.doc,
                                    hal::PinOptions<bool>{.initial = row.initial != 0.0});
                break;
            }
        }
    }

    hal::TextArgument plant{
        *this, "plant", "axis",
        "simulated plant: axis (a slide on a screw) or furuta (the pendulum rig)"};
    hal::Argument input_stops{*this,
                              "input_stops",
                              0,
                              "initial value of object 2111h; 1: an open input is a fault",
                              {.min = 0, .max = 1}};

    hal::Function run{*this, "update", &CanopenAxisIo::update,
                      "receives frames, advances the plant, sends frames"};

    hal::In<bool> encoder_broken{*this, "encoder-broken", "true: the encoder cable is cut"};
    hal::Out<double> position{*this,
                              "position",
                              "true position of the motor shaft, or of the arm",
                              {.unit = "rad", .finite = true}};
    hal::Out<double> second_position{*this,
                                     "second-position",
                                     "true position of the screw's end, or of the pendulum",
                                     {.unit = "rad", .finite = true}};
    hal::Out<double> pwm{*this, "pwm", "duty cycle of the amplifier, -1..1", {.finite = true}};
    hal::Out<double> current{*this, "current", "motor current", {.unit = "A", .finite = true}};
    hal::Out<bool> enabled{*this, "enabled",
                           "the amplifier is on: the motor follows the set-point"};
    hal::Out<bool> fault{*this, "fault", "the axis is in fault"};
    hal::Out<std::uint32_t> axis_state{*this, "axis-state",
                                       "state of the axis: 0 stopped, 1 ready, 2 on, 3 fault"};
    hal::Out<std::uint32_t> error_code{*this, "error-code", "603Fh"};
    hal::Outs<bool> out{*this, "out-#", 4, "terminal of output #", {.safe = false}};

    void update(hal::Cycle cycle) noexcept {
        act();
        program_->break_encoder(encoder_broken);
        turn(cycle);
        const bool on = node().powered();
        const auto& p = *program_;
        if (!on) {
            program_->plant().step(0.0, false, cycle.period_ns());
        }
        position = p.plant().position();
        second_position = p.plant().second_position();
        pwm = on ? p.duty() : 0.0;
        current = p.plant().current();
        enabled = on && p.state() == AxisIo::State::on;
        fault = on && p.state() == AxisIo::State::fault;
        axis_state = on ? static_cast<std::uint32_t>(p.state()) : 0U;
        error_code = p.error_code();
        for (unsigned n = 0; n < out.size(); ++n) {
            out[n] = on && p.output(n);
        }
    }

private:
    void act() noexcept {
        auto& of = program_->plant();
        std::size_t value = 0;
        std::size_t tap = 0;
        std::size_t flag = 0;
        std::size_t n = 0;
        for (const auto& row : of.influences()) {
            if (row.kind == Influence::value) {
                of.put(n, values_[value++]);
            } else if (row.kind == Influence::flag) {
                of.put(n, flags_[flag++] ? 1.0 : 0.0);
            } else if (auto& pin = taps_[tap++]; pin != 0.0) {
                of.put(n, pin);
                pin = 0.0;
            }
            ++n;
        }
    }
    Program& program() override {
        program_ = std::make_unique<AxisIo>(AxisIoSettings{serial(), heartbeat(), input_stops != 0},
                                            make_plant(plant.get()));
        return *program_;
    }
    // pins of the plant's influences of kind value, in their order; likewise taps_ and flags_
    std::deque<hal::In<double>> values_;
    std::deque<hal::Io<double>> taps_;
    std::deque<hal::In<bool>> flags_;
    std::unique_ptr<AxisIo> program_;
};

}  // namespace

HAL_COMPONENT(CanopenAxisIo, "canopen_axis_io",
              "Simulated CANopen axis with its control loop closed over the bus", R"(
The remote end of a control loop over the bus, for machines without the hardware: a node with a
pulse-width amplifier, two 16-bit encoder counters, four outputs and an input, and the simulated
plant behind it. The controller is in the master's netlist. The node samples both counters at every
SYNC; received set-points take effect at once. Its states are those of CiA 402 (controlword 6040h,
statusword 6041h), so the component `cia402` with `mode` 4 and `counter-bits` 16 controls them; a
motor that is not on carries no current. RPDO 1 carries the controlword, 2100h PWM set-point
(-32767..32767) and 2103h outputs; TPDO 1 the statusword, 2101h and 2102h (counts of both encoders)
and 2104h inputs. 2105h is the current in mA. When `2110h` SYNC periods (1006h; usually 3) pass
without a SYNC or a set-point, the motor is switched off with fault 8700h. Fault 7305h is a broken
encoder; with 2111h = 1 an open input is fault 9000h.

`plant=axis` is a slide on a screw of 5 mm pitch. `plant=furuta` is the Furuta pendulum, with the
arm on the first encoder, the pendulum on the second and the contact under the base at the input. On
a `sim:` bus the node answers in the cycle of `update` that receives the request. `hal node axis-io`
runs the same device as a process; `hal node axis-io --eds` prints its EDS.

    loadrt canopen_axis_io link=cane:sim:rig id=2 plant=furuta
    addf canopen-axis-io.0.update servo
    start
)")
