// SPDX-License-Identifier: MIT
#include "canopen/device/component.hpp"
#include "canopen/device/io/io.hpp"

namespace {

using namespace hal::canopen;

struct CanopenIo final : NodeComponent {
    explicit CanopenIo(const hal_host* host) : NodeComponent(host, 3) {}

    hal::Argument inputs{*this, "inputs", 64, "number of digital inputs", {.min = 0, .max = 64}};
    hal::Argument outputs{*this, "outputs", 64, "number of digital outputs", {.min = 0, .max = 64}};
    hal::Argument analog_inputs{
        *this, "analog_inputs", 12, "number of analogue inputs", {.min = 0, .max = 12}};
    hal::Argument analog_outputs{
        *this, "analog_outputs", 12, "number of analogue outputs", {.min = 0, .max = 12}};

    hal::Function run{*this, "update", &CanopenIo::update,
                      "receives and sends frames, copies values between pins and objects"};

    hal::Ins<bool> in{*this, "in-##", inputs, "terminal of digital input ##"};
    hal::Outs<bool> out{*this, "out-##", outputs, "terminal of digital output ##", {.safe = false}};
    hal::Ins<double> analog_in{
        *this, "analog-in-##", analog_inputs, "terminal of analogue input ##", {.unit = "V"}};
    hal::Outs<double> analog_out{*this,
                                 "analog-out-##",
                                 analog_outputs,
                                 "terminal of analogue output ##",
                                 {.unit = "V", .safe = 0.0}};
    hal::Out<bool> safe{*this, "safe",
                        "outputs are at their error values and have not been written since"};
    hal::Param<double> range{*this,
                             "range",
                             "full-scale voltage (32767 counts) of analogue inputs and outputs",
                             {.initial = 10.0, .unit = "V"}};

    void update(hal::Cycle cycle) noexcept {
        const double volts = range > 0.0 ? range.get() : 10.0;
        for (unsigned n = 0; n < in.size(); ++n) {
            io_->set_input(n, in[n]);
        }
        for (unsigned n = 0; n < analog_in.size(); ++n) {
            io_->set_analog_input(n, analog_in[n] / volts);
        }
        turn(cycle);
        const bool on = node().powered();
        for (unsigned n = 0; n < out.size(); ++n) {
            out[n] = on && io_->output(n);
        }
        for (unsigned n = 0; n < analog_out.size(); ++n) {
            analog_out[n] = on ? io_->analog_output(n) * volts : 0.0;
        }
        safe = io_->safe();
    }

private:
    Program& program() override {
        const auto count = [](const hal::Argument& a) { return static_cast<unsigned>(a); };
        io_ = std::make_unique<Io>(IoSettings{count(inputs), count(outputs), count(analog_inputs),
                                              count(analog_outputs), serial(), heartbeat()});
        return *io_;
    }
    std::unique_ptr<Io> io_;
};

}  // namespace

HAL_COMPONENT(CanopenIo, "canopen_io", "Simulated CANopen I/O node (CiA 401)", R"(
A node with digital and analogue inputs and outputs on a CAN bus, a simulated bus coupler for
machines without the hardware. The terminals are pins; the objects are those of CiA 401: polarity,
input filter, interrupt masks, limits and deltas, error modes and error values. By default RPDO 1
carries the digital outputs, RPDO 2 to 4 the analogue outputs; TPDO 1 carries the digital inputs and
is sent when one changes, TPDO 2 to 4 carry the analogue inputs and are sent on change only when
object 6423h is true.

Outputs take their error values (6206h, 6207h, 6443h, 6444h) when the node is stopped, on loss of a
heartbeat it consumes (1016h) or of the master's life guarding, and on bus off. They keep them until
they are written again.

On a `sim:` bus the node answers in the cycle of `update` that receives the request, so put `update`
into a thread as fast as the bus needs. `hal node io` runs the same device as a process;
`hal node io --eds` prints its EDS.

    loadrt canopen_io link=sim:arm id=5 start_by_itself=1
    addf canopen-io.0.update servo
    start
)")
