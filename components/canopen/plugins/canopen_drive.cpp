// SPDX-License-Identifier: MIT
#include <cmath>

#include "canopen/device/component.hpp"
#include "canopen/device/drive/drive_program.hpp"

namespace {

using namespace hal::canopen;
namespace cia402 = hal::cia402;

struct CanopenDrive final : NodeComponent {
    explicit CanopenDrive(const hal_host* host) : NodeComponent(host, 2) {}

    hal::Argument axes{*this, "axes", 1, "number of axes", {.min = 1, .max = 8}};
    hal::TextArgument motor{*this, "motor", "",
                            "motor parameters that differ from the defaults, for all axes, as in "
                            "inertia:1e-4,resolution:8192,endless:1"};
    const cia402::MotorSettings the_motor = parsed(motor.get());

    hal::Function run{*this, "update", &CanopenDrive::update,
                      "receives frames, advances the motors, sends frames"};

    hal::Ins<double> load_torque{
        *this, "load-torque-#", axes, "external torque on the shaft of axis #", {.unit = "N*m"}};
    hal::Ins<double> dc_link{
        *this,
        "dc-link-#",
        axes,
        "DC link voltage of axis #; valid range 70..130 % of the rated voltage",
        {.initial = the_motor.rated_voltage, .unit = "V"}};
    hal::Ins<std::uint32_t> inputs{
        *this, "inputs-#", axes,
        "bits 16..31 of the digital inputs (60FDh) of axis #; 16 and 17 are the touch probes"};
    hal::Ins<bool> encoder_broken{*this, "encoder-broken-#", axes,
                                  "true: the encoder cable of axis # is cut"};

    hal::Outs<double> position{*this, "position-#", axes, "position of axis #", {.unit = "rev"}};
    hal::Outs<double> velocity{*this, "velocity-#", axes, "velocity of axis #", {.unit = "rev/s"}};
    hal::Outs<double> torque{*this, "torque-#", axes, "motor torque of axis #", {.unit = "N*m"}};
    hal::Outs<double> current{*this, "current-#", axes, "motor current of axis #", {.unit = "A"}};
    hal::Outs<bool> enabled{*this, "enabled-#", axes, "axis # is in operation enabled"};
    hal::Outs<bool> fault{*this, "fault-#", axes, "axis # is in fault"};
    hal::Outs<bool> homed{*this, "homed-#", axes, "axis # has been homed since power-on"};
    hal::Outs<bool> brake{*this, "brake-#", axes, "the brake of axis # is closed"};
    hal::Outs<std::uint32_t> drive_state{
        *this, "drive-state-#", axes,
        "CiA 402 state of axis #: 0 not ready, 1 switch on disabled, 2 ready, 3 switched on, 4 "
        "operation enabled, 5 quick stop active, 6 fault reaction, 7 fault"};
    hal::Outs<std::int32_t> mode{*this, "mode-#", axes, "mode of operation of axis #, 6061h"};
    hal::Outs<std::uint32_t> error_code{*this, "error-code-#", axes,
                                        "error code (603Fh) of axis #"};
    hal::Outs<std::uint32_t> outputs{*this, "outputs-#", axes, "digital outputs (60FEh) of axis #"};

    void update(hal::Cycle cycle) noexcept {
        auto& drive = program_->drive();
        for (unsigned n = 0; n < load_torque.size(); ++n) {
            const double load = load_torque[n];
            const double volts = dc_link[n];
            drive.set_load_torque(n, std::isfinite(load) ? load : 0.0);
            drive.set_dc_link(n, std::isfinite(volts) ? volts : 0.0);
            drive.set_inputs(n, inputs[n]);
            drive.set_encoder_broken(n, encoder_broken[n]);
        }
        turn(cycle);
        const bool on = node().powered();
        const double resolution = the_motor.resolution;
        for (unsigned n = 0; n < load_torque.size(); ++n) {
            const auto s = drive.status(n);
            position[n] = s.place / resolution;
            velocity[n] = s.speed / 60.0;
            torque[n] = on ? s.torque : 0.0;
            current[n] = on ? s.current : 0.0;
            enabled[n] = on && s.state == cia402::State::operation_enabled;
            fault[n] = on && (s.state == cia402::State::fault ||
                              s.state == cia402::State::fault_reaction_active);
            homed[n] = s.homed;
            brake[n] = s.brake_closed;
            drive_state[n] = static_cast<std::uint32_t>(s.state);
            mode[n] = static_cast<std::int32_t>(s.mode);
            error_code[n] = s.error_code;
            outputs[n] = s.outputs;
        }
    }

private:
    static cia402::MotorSettings parsed(std::string_view text) {
        cia402::MotorSettings settings;
        if (auto problem = parse_motor(text, settings); !problem.empty()) {
            throw std::invalid_argument(problem);
        }
        return settings;
    }
    Program& program() override {
        DriveSettings settings;
        settings.axes = static_cast<unsigned>(axes);
        for (auto& axis : settings.axis) {
            axis.motor = the_motor;
        }
        settings.serial = serial();
        settings.heartbeat_ms = heartbeat();
        program_ = std::make_unique<DriveProgram>(settings);
        return *program_;
    }
    std::unique_ptr<DriveProgram> program_;
};

}  // namespace

HAL_COMPONENT(CanopenDrive, "canopen_drive", "Simulated CANopen drive (CiA 402), up to eight axes",
              R"(
A servo drive on a CAN bus with its motors simulated, for machines without the hardware: the state
machine and all modes of CiA 402 (pp, vl, pv, tq, hm, ip, csp, csv, cst), homing methods 1 to 37,
touch probes, limits, brakes and faults. The objects of axis n are at +0x800 n, its PDOs at +64 n.

`motor` sets motor parameters as NAME:VALUE, in SI units and encoder increments:
`motor=inertia:1e-4,endless:1` is a wheel. Names: resolution, endless, inertia, viscous-friction,
coulomb-friction, rated-torque, peak-torque, rated-current, rated-voltage, highest-speed, start,
negative-limit, positive-limit, negative-stop, positive-stop, home-from, home-to, brake-torque.

On a `sim:` bus the drive answers in the cycle of `update` that receives the request: put `update`
into a thread as fast as the bus needs. `hal node drive` runs the same device as a process;
`hal node drive --eds` prints its EDS.

    loadrt canopen_drive link=sim:arm id=2 axes=2
    addf canopen-drive.0.update servo
    start
)")
