// SPDX-License-Identifier: MIT
#include <algorithm>

#include "cia402/axis.hpp"
#include "hal/component.hpp"

namespace {

using namespace hal::canopen;
using namespace hal::canopen::cia402;

struct Cia402 : hal::Component {
    using Component::Component;

    // What the user asks for.
    hal::In<bool> enable{*this, "enable", "a rising edge switches the axis on, FALSE off; after a fault it takes another edge"};
    hal::In<bool> reset{*this, "reset", "a rising edge forgets a fault, and resets that of the drive"};
    hal::In<bool> quick_stop{*this, "quick-stop", "TRUE: brakes by the drive's quick stop and goes off; then enable needs another edge"};
    hal::In<bool> halt{*this, "halt", "TRUE: stands still, enabled"};
    hal::In<std::int32_t> mode{*this, "mode", "of operation: see the table; 0: as the drive has it", {.initial = 8}};
    hal::In<double> position_cmd{*this, "position-cmd", "csp, ip: where to be; pp: the set-point that `go` gives"};
    hal::In<double> velocity_cmd{*this, "velocity-cmd", "csv, pv, vl: how fast; csp: given ahead", {.unit = "1/s"}};
    hal::In<double> torque_cmd{*this, "torque-cmd", "cst, tq: how much; csp, csv: given ahead"};
    hal::In<bool> home{*this, "home", "a rising edge starts homing; FALSE ends it before its time"};
    hal::In<bool> go{*this, "go", "pp: a rising edge makes position-cmd a new set-point; up to 16 wait for room in the drive"};
    hal::In<bool> relative{*this, "relative", "pp: the set-point counts from the last one"};
    hal::In<bool> immediate{*this, "immediate", "pp: the set-point takes the place of what the drive does now"};
    hal::In<bool> blend{*this, "blend", "pp: the drive need not stop at this set-point when there is another"};
    hal::In<double> max_velocity{*this, "max-velocity", "to profile-velocity: of moves that the drive plans", {.unit = "1/s"}};
    hal::In<double> max_acceleration{*this, "max-acceleration", "to profile-acceleration", {.unit = "1/s^2"}};
    hal::In<double> max_deceleration{*this, "max-deceleration", "to profile-deceleration; 0: as max-acceleration", {.unit = "1/s^2"}};

    hal::Param<double> position_scale{*this, "position-scale", "counts per unit; negative: the other direction", {.initial = 1.0}};
    hal::Param<double> position_divisor{*this, "position-scale-divisor", "by which position-scale is divided", {.initial = 1.0}};
    hal::Param<double> velocity_scale{*this, "velocity-scale", "the drive's velocity per unit/s; 0: as position-scale"};
    hal::Param<double> velocity_divisor{*this, "velocity-scale-divisor", "by which velocity-scale is divided", {.initial = 1.0}};
    hal::Param<double> acceleration_scale{*this, "acceleration-scale", "the drive's acceleration per unit/s^2; 0: as the velocity"};
    hal::Param<double> acceleration_divisor{*this, "acceleration-scale-divisor", "divides acceleration-scale", {.initial = 1.0}};
    hal::Param<double> torque_scale{*this, "torque-scale", "thousandths of the rated torque per unit", {.initial = 1000.0}};
    hal::Param<double> vl_scale{*this, "vl-scale", "mode vl: its unit, r/min, per unit/s", {.initial = 60.0}};
    hal::Param<std::uint32_t> counter_bits{*this, "counter-bits", "of position-actual-value that count", {.initial = 32}};
    hal::Param<double> max_step{*this, "max-step", "farthest position-cmd may go in a cycle; beyond it is a fault; 0: not watched"};
    hal::Param<double> blend_time{*this, "blend-time", "max-step 0: in that time a position-cmd that is elsewhere at enabling is joined",
                                  {.initial = 0.5, .unit = "s"}};
    hal::Param<double> max_error{*this, "max-following-error", "csp, ip: beyond it is a fault; 0: not watched"};
    hal::Param<double> step_timeout{*this, "step-timeout", "for a transition, a mode, an acknowledge", {.initial = 2.0, .unit = "s"}};
    hal::Param<double> stop_timeout{*this, "stop-timeout", "to come to rest; then its voltage is disabled", {.initial = 10.0, .unit = "s"}};
    hal::Param<double> homing_timeout{*this, "homing-timeout", "longest for homing; 0: no limit", {.unit = "s"}};
    hal::Param<bool> auto_reset{*this, "auto-reset", "TRUE: a rising edge of enable is one of reset, too"};

    // What it tells the user.
    hal::Out<bool> enabled{*this, "enabled", "operation enabled, as asked for", {.safe = false}};
    hal::Out<bool> active{*this, "active", "commands are followed; while FALSE let position-cmd follow position-fb", {.safe = false}};
    hal::Out<bool> fault{*this, "fault", "TRUE: the axis went off or refused, until reset; see fault-code and `show fault`"};
    hal::Out<std::uint32_t> fault_code{*this, "fault-code", "why; see the table"};
    hal::Out<std::uint32_t> failed_step{*this, "failed-step", "which step the drive did not take; see the table"};
    hal::Out<std::uint32_t> state{*this, "state", "of the drive; see the table"};
    hal::Out<double> position_fb{*this, "position-fb", "measured; goes on where the drive's counter wraps", {.finite = true}};
    hal::Out<double> velocity_fb{*this, "velocity-fb", "measured, or from the position", {.unit = "1/s", .finite = true}};
    hal::Out<double> torque_fb{*this, "torque-fb", "measured", {.finite = true}};
    hal::Out<double> following_error{*this, "following-error", "csp, ip: position told - position-fb", {.finite = true}};
    hal::Out<bool> target_reached{*this, "target-reached", "pp: all set-points are done; else as the drive says"};
    hal::Out<std::uint32_t> set_points{*this, "set-points", "pp: that wait for room in the drive"};
    hal::Out<bool> homed{*this, "homed", "since its node was last there"};
    hal::Out<bool> homing{*this, "homing", "homing is under way"};
    hal::Out<std::int32_t> mode_fb{*this, "mode-fb", "the mode the drive shows"};
    hal::Out<bool> warning{*this, "warning", "statusword bit 7"};
    hal::Out<bool> remote{*this, "remote", "statusword bit 9: the drive obeys the bus"};
    hal::Out<bool> voltage{*this, "voltage-enabled", "statusword bit 4: its power stage is supplied"};
    hal::Out<bool> limited{*this, "internal-limit", "statusword bit 11"};

    // The drive's side, named as CiA 402 names the objects.
    hal::In<bool> operational{*this, "operational", "its node is there: net it with that pin of the bus", {.initial = true}};
    hal::In<std::uint32_t> statusword{*this, "statusword", "6041h"};
    hal::In<std::int32_t> mode_display{*this, "modes-of-operation-display", "6061h; unlinked: changes of mode are not watched"};
    hal::In<std::int32_t> position{*this, "position-actual-value", "6064h"};
    hal::In<std::int32_t> velocity{*this, "velocity-actual-value", "606Ch; may stay unlinked"};
    hal::In<std::int32_t> vl_velocity{*this, "vl-velocity-actual-value", "6044h; velocity-fb of mode vl when linked"};
    hal::In<std::int32_t> torque{*this, "torque-actual-value", "6077h"};
    hal::In<std::uint32_t> error_code{*this, "error-code", "603Fh, or the emcy pin of its node; may stay unlinked"};
    hal::Out<std::uint32_t> controlword{*this, "controlword", "6040h", {.safe = 0U}};
    hal::Out<std::int32_t> mode_out{*this, "modes-of-operation", "6060h"};
    hal::Out<std::int32_t> target_position{*this, "target-position", "607Ah"};
    hal::Out<std::int32_t> target_velocity{*this, "target-velocity", "60FFh", {.safe = 0}};
    hal::Out<std::int32_t> target_torque{*this, "target-torque", "6071h", {.safe = 0}};
    hal::Out<std::int32_t> vl_target{*this, "vl-target-velocity", "6042h", {.safe = 0}};
    hal::Out<std::int32_t> velocity_offset{*this, "velocity-offset", "60B1h", {.safe = 0}};
    hal::Out<std::int32_t> torque_offset{*this, "torque-offset", "60B2h", {.safe = 0}};
    hal::Out<std::int32_t> interpolation{*this, "interpolation-data-record", "60C1h:1"};
    hal::Out<std::uint32_t> profile_velocity{*this, "profile-velocity", "6081h"};
    hal::Out<std::uint32_t> profile_acceleration{*this, "profile-acceleration", "6083h"};
    hal::Out<std::uint32_t> profile_deceleration{*this, "profile-deceleration", "6084h"};

    hal::Function read{*this, "read-all", &Cia402::read_all, "from the drive's side to the feedback; after the bus receives"};
    hal::Function write{*this, "write-all", &Cia402::write_all, "from the commands to the drive's side; before the bus sends"};

    void start() { faults_ = hal::extension<hal_faults>("hal.faults/1"); }

    void read_all(hal::Cycle cycle) noexcept {
        read_rules();
        AxisFeedback in;
        in.operational = operational;
        in.statusword = static_cast<std::uint16_t>(statusword);
        in.error_code = static_cast<std::uint16_t>(error_code);
        in.has_mode = mode_display.linked();
        in.mode = static_cast<Mode>(in.has_mode ? mode_display.get() : mode.get());
        in.position = position;
        in.has_velocity = velocity.linked();
        in.velocity = velocity;
        in.has_vl_velocity = vl_velocity.linked();
        in.vl_velocity = static_cast<std::int16_t>(vl_velocity);
        in.torque = static_cast<std::int16_t>(torque);
        axis_.observe(in, rules_, cycle.start_ns());
        position_fb = axis_.position();
        velocity_fb = axis_.velocity();
        torque_fb = axis_.torque();
        mode_fb = static_cast<std::int32_t>(in.mode);
        warning = (in.statusword & status::warning) != 0;
        remote = (in.statusword & status::remote) != 0;
        voltage = (in.statusword & status::voltage_enabled) != 0;
        limited = (in.statusword & status::internal_limit) != 0;
    }

    void write_all(hal::Cycle cycle) noexcept {
        AxisCommand c;
        c.enable = enable, c.reset = reset, c.quick_stop = quick_stop, c.halt = halt, c.home = home;
        c.go = go, c.relative = relative, c.immediate = immediate, c.blend = blend;
        c.mode = static_cast<Mode>(mode.get());
        c.position = position_cmd, c.velocity = velocity_cmd, c.torque = torque_cmd;
        c.profile_velocity = max_velocity;
        c.profile_acceleration = max_acceleration;
        c.profile_deceleration = max_deceleration != 0.0 ? max_deceleration : max_acceleration;
        tell(axis_.act(c, rules_, cycle.start_ns()));

        enabled = axis_.enabled();
        active = axis_.active();
        fault = axis_.fault();
        const Failure& failure = axis_.failure();
        if (faults_ != nullptr && failure && failure.cause != reported_)
            faults_->raise(faults_, this, made_.find(failure), Sentences::number(failure));
        reported_ = failure.cause;
        fault_code = static_cast<std::uint32_t>(failure.cause);
        failed_step = static_cast<std::uint32_t>(failure.step);
        state = static_cast<std::uint32_t>(axis_.state());
        following_error = axis_.following_error();
        target_reached = axis_.target_reached();
        set_points = static_cast<std::uint32_t>(axis_.set_points());
        homed = axis_.homed();
        homing = axis_.homing();
    }

private:
    static Time time(double seconds) noexcept {
        return seconds > 0.0 ? static_cast<Time>(std::min(seconds, 1e6) * static_cast<double>(one_second)) : 0;
    }
    static const Sentences& sentences() {
        static const Sentences all;
        return all;
    }

    void read_rules() noexcept {
        rules_.position = {position_scale, position_divisor};
        rules_.velocity = velocity_scale != 0.0 ? Factor{velocity_scale, velocity_divisor} : rules_.position;
        rules_.acceleration = acceleration_scale != 0.0 ? Factor{acceleration_scale, acceleration_divisor} : rules_.velocity;
        rules_.torque = {torque_scale, 1.0};
        rules_.vl = {vl_scale, 1.0};
        rules_.counter_bits = counter_bits;
        rules_.limits = {time(step_timeout), time(stop_timeout)};
        rules_.homing = time(homing_timeout);
        rules_.blend = time(blend_time);
        rules_.max_step = max_step;
        rules_.max_following_error = max_error;
        rules_.auto_reset = auto_reset;
    }

    void tell(const AxisOrders& orders) noexcept {
        controlword = orders.controlword;
        mode_out = static_cast<std::int32_t>(orders.mode);
        target_position = orders.target_position;
        target_velocity = orders.target_velocity;
        target_torque = orders.target_torque;
        vl_target = orders.vl_target_velocity;
        velocity_offset = orders.velocity_offset;
        torque_offset = orders.torque_offset;
        interpolation = orders.interpolation;
        profile_velocity = orders.profile_velocity;
        profile_acceleration = orders.profile_acceleration;
        profile_deceleration = orders.profile_deceleration;
    }

    const hal_faults* faults_ = nullptr;
    const Sentences& made_ = sentences();
    Axis axis_;
    AxisRules rules_;
    Cause reported_ = Cause::none;
};

}  // namespace

HAL_COMPONENT(Cia402, "cia402", "One axis of a CiA 402 drive: states, modes, homing, units, supervision", R"(
The master's side of a servo drive on any bus: the pins of its process data on one side, an axis in units of the user on the other. It
keeps a copy of the drive's state machine and walks it to where it should be, a transition per cycle.

* `enable` walks to *operation enabled*. When a step is not taken within `step-timeout`, the axis is in fault and `show fault` says which:
  `x: enable: drive stays in "switched on" after "enable operation" for 2 s`. FALSE brakes by the ramp of the drive and switches off; TRUE
  again before it has done so enables it anew.
* While it is not enabled, the position told to the drive is the measured one, so it does not jump when it is. `position-cmd` should follow
  `position-fb` while `active` is FALSE. What it is away then is refused when it is more than `max-step`, and removed over `blend-time`
  when that is 0.
* A fault (see the table) brakes by quick stop, switches off, and stays until a rising edge of `reset`. After it, after `quick-stop`
  and after the node was lost, `enable` needs another rising edge. Before the node was there, it waits.
* `mode` may change at any time; the command is followed when the drive shows the new mode.
* `halt` brakes by the ramp of the drive in modes 1 to 7. In the cyclic ones the target stays where it is, or is 0, at once: bring the
  command to rest first.
* `home` selects mode hm, starts homing with what the drive's objects 6098h, 6099h and 609Ah say, waits, and returns to `mode`.
  Then `position-fb` is what the drive counts.
* `position-fb` = counts * `position-scale-divisor` / `position-scale`, without end though the drive's counter wraps.

`read-all` belongs behind the function that receives, `write-all` before the one that sends; what commands the axis stands between.

| mode | | follows |
| --- | --- | --- |
| 1 | pp, profile position | `position-cmd` at each rising edge of `go` |
| 2 | vl, velocity | `velocity-cmd` |
| 3 | pv, profile velocity | `velocity-cmd` |
| 4 | tq, profile torque | `torque-cmd` |
| 6 | hm, homing | `home` |
| 7 | ip, interpolated position | `position-cmd` |
| 8 | csp, cyclic synchronous position | `position-cmd`; `velocity-cmd` and `torque-cmd` ahead |
| 9 | csv, cyclic synchronous velocity | `velocity-cmd`; `torque-cmd` ahead |
| 10 | cst, cyclic synchronous torque | `torque-cmd` |

| fault-code | |
| --- | --- |
| 0 | none |
| 1 | the drive did not take a step: `failed-step` |
| 2 | the drive is in fault: `error-code` |
| 3 | it left *operation enabled* without being told |
| 4 | its node is not operational any more |
| 5 | it does not show the mode asked for |
| 6 | following error above `max-following-error` |
| 7 | `position-cmd` stepped farther than `max-step`, or was that far from `position-fb` at enabling |
| 8 | a command is not a number, or too large |
| 9 | a scale is 0 or not a number |
| 10 | the drive reports a homing error |
| 11 | homing took longer than `homing-timeout` |
| 12 | pp: a set-point was not acknowledged |
| 13 | `home` or `go` without `enabled` |

`failed-step`: 0 wait, 1 shutdown, 2 switch on, 3 enable operation, 4 disable operation, 5 disable voltage, 6 quick stop, 7 fault reset.
`state`: 0 not ready to switch on, 1 switch on disabled, 2 ready to switch on, 3 switched on, 4 operation enabled, 5 quick stop active,
6 fault reaction active, 7 fault, 8 none of these.

For those who know LinuxCNC's component of that name: `pos-cmd`, `pos-fb`, `velocity-cmd`, `opmode`, `opmode-display`,
`drv-actual-position`, `drv-target-position`, `pos-scale` and `stat-*` are `position-cmd`, `position-fb`, `velocity-cmd`,
`modes-of-operation`, `modes-of-operation-display`, `position-actual-value`, `target-position`, `position-scale`, and `state` with the
pins beside it; `csp-mode` is `mode` 8 or 9.

    loadrt cia402 names=x
    addf x.read-all servo
    addf x.write-all servo
    setp x.position-scale 10000
    setp x.max-step 0.1
    net x-enable => x.enable
    net x-cmd    => x.position-cmd
    net x-fb     <= x.position-fb
    net x-fault  <= x.fault
)")
