// SPDX-License-Identifier: MIT
#include <algorithm>
#include <atomic>
#include <cmath>

#include "canopen/plugins/probe_pins.hpp"
#include "cia402/axis.hpp"
#include "hal/component.hpp"
#include "hal/function_monitor.hpp"
#include "hal/lasting_fault.hpp"
#include "hal/limit.hpp"
#include "hal/naming.hpp"
#include "hal/retained.hpp"

namespace {

using namespace hal::cia402;

struct Cia402 : hal::Component {
    using Component::Component;

    // Commands of the user.
    hal::In<bool> enable{*this, "enable",
                         "a rising edge enables the axis, FALSE disables it; after a fault or a "
                         "stop another edge is needed"};
    hal::In<bool> reset{*this, "reset",
                        "a rising edge clears the fault of the axis and of the drive"};
    hal::In<bool> quick_stop{*this, "quick-stop",
                             "TRUE: brakes with the drive's quick stop and disables the axis; then "
                             "enable needs another edge"};
    hal::In<bool> halt{*this, "halt", "TRUE: brakes to standstill and stays enabled"};
    hal::In<std::int32_t> mode{*this,
                               "mode",
                               "mode of operation, see the table; 0: keep the mode of the drive",
                               {.initial = 8}};
    hal::In<double> position_cmd{*this, "position-cmd",
                                 "csp, ip: commanded position; pp: target of the next set-point"};
    hal::In<double> velocity_cmd{*this,
                                 "velocity-cmd",
                                 "csv, pv, vl: commanded velocity; csp: feed-forward",
                                 {.unit = "1/s"}};
    hal::In<double> torque_cmd{*this, "torque-cmd",
                               "cst, tq: commanded torque; csp, csv: feed-forward"};
    hal::In<bool> home{*this, "home", "a rising edge starts homing; FALSE aborts it"};
    hal::In<bool> go{*this, "go",
                     "pp: a rising edge makes position-cmd a new set-point; up to 16 are queued "
                     "until the drive takes them"};
    hal::In<bool> relative{*this, "relative", "pp: the set-point is relative to the previous one"};
    hal::In<bool> immediate{*this, "immediate",
                            "pp: the set-point replaces the current move at once; those that the "
                            "drive has not taken yet are dropped, or added to a relative one"};
    hal::In<bool> blend{*this, "blend",
                        "pp: the drive passes this set-point without stopping if another follows"};
    hal::Limit max_velocity{*this,
                            "max-velocity",
                            "profile velocity (profile-velocity) of moves planned by the drive",
                            {.unit = "1/s"}};
    hal::Limit max_acceleration{*this,
                                "max-acceleration",
                                "acceleration (profile-acceleration) of moves planned by the drive",
                                {.unit = "1/s^2"}};
    hal::In<double> max_deceleration{
        *this,
        "max-deceleration",
        "deceleration (profile-deceleration) of these moves; 0: same as max-acceleration",
        {.unit = "1/s^2"}};

    hal::Param<double> position_scale{
        *this, "position-scale", "counts per unit; negative: reversed", {.initial = 1.0}};
    hal::Param<double> position_divisor{
        *this, "position-scale-divisor", "divisor of position-scale", {.initial = 1.0}};
    hal::Param<double> velocity_scale{
        *this, "velocity-scale",
        "velocity units of the drive per unit/s; 0: same as position-scale"};
    hal::Param<double> velocity_divisor{
        *this, "velocity-scale-divisor", "divisor of velocity-scale", {.initial = 1.0}};
    hal::Param<double> acceleration_scale{
        *this, "acceleration-scale",
        "acceleration units of the drive per unit/s^2; 0: same as the velocity"};
    hal::Param<double> acceleration_divisor{
        *this, "acceleration-scale-divisor", "divisor of acceleration-scale", {.initial = 1.0}};
    hal::Param<double> torque_scale{*this,
                                    "torque-scale",
                                    "thousandths of the rated torque per unit of torque",
                                    {.initial = 1000.0}};
    hal::Param<double> vl_scale{*this, "vl-scale", "mode vl: r/min per unit/s", {.initial = 60.0}};
    hal::Param<std::uint32_t> counter_bits{
        *this, "counter-bits", "valid bits of position-actual-value", {.initial = 32}};
    hal::OptionalLimitParam max_step{
        *this, "max-step",
        "largest step of position-cmd in one cycle, a larger one is a fault; 0: not checked"};
    hal::Param<double> blend_time{*this,
                                  "blend-time",
                                  "with max-step 0: time to blend out the distance between "
                                  "position-cmd and position-fb at enabling",
                                  {.initial = 0.5, .unit = "s"}};
    hal::OptionalLimitParam max_error{
        *this, "max-following-error",
        "csp, ip: largest following error, a larger one is a fault; 0: not checked"};
    hal::Param<double> step_timeout{
        *this,
        "step-timeout",
        "timeout of a state transition, a mode change, a set-point acknowledge",
        {.initial = 2.0, .unit = "s"}};
    hal::Param<double> stop_timeout{
        *this,
        "stop-timeout",
        "timeout of braking to standstill; then the voltage is disabled",
        {.initial = 10.0, .unit = "s"}};
    hal::Param<double> homing_timeout{
        *this, "homing-timeout", "timeout of homing; 0: none", {.unit = "s"}};
    hal::Param<bool> auto_reset{*this, "auto-reset",
                                "TRUE: a rising edge of enable also acts as one of reset"};

    hal::Function read{*this, "read-all", &Cia402::read_all,
                       "updates the feedback from the drive; after the bus receives"};
    hal::Function write{*this, "write-all", &Cia402::write_all,
                        "updates the drive from the commands; before the bus sends"};

    // Status for the user.
    hal::Out<bool> enabled{
        *this, "enabled", "the drive is in operation enabled, as commanded", {.safe = false}};
    hal::Out<bool> active{
        *this,
        "active",
        "the drive follows the commands; while FALSE, let position-cmd track position-fb",
        {.safe = false}};
    hal::Out<bool> fault{*this, "fault",
                         "TRUE: the axis was disabled or rejected a command, until reset; see "
                         "fault-code and `show fault`"};
    hal::Out<std::uint32_t> fault_code{*this, "fault-code", "cause of the fault, see the table"};
    hal::Out<std::uint32_t> failed_step{*this, "failed-step",
                                        "state transition the drive did not make, see the table"};
    hal::Out<bool> keeps_power{
        *this, "keeps-power",
        "TRUE: the drive has power although it was commanded off or to stop and the timeout has "
        "expired; connect it to what removes the power by other means, such as a contactor"};
    hal::Out<std::uint32_t> state{*this, "state", "state of the drive, see the table"};
    hal::Out<double> position_fb{
        *this,
        read,
        "position-fb",
        "measured position, extended beyond the range of the drive's counter",
        {.finite = true}};
    hal::Out<double> velocity_fb{*this,
                                 read,
                                 "velocity-fb",
                                 "measured velocity, or the derivative of the position",
                                 {.unit = "1/s", .finite = true}};
    hal::Out<double> torque_fb{*this, read, "torque-fb", "measured torque", {.finite = true}};
    hal::Out<double> following_error{*this,
                                     "following-error",
                                     "csp, ip: position sent to the drive - position-fb",
                                     {.finite = true}};
    hal::Out<bool> target_reached{*this, "target-reached",
                                  "pp: all set-points are reached, and none was discarded by a "
                                  "stop; other modes: target reached bit of the drive"};
    hal::Out<std::uint32_t> set_points{*this, "set-points",
                                       "pp: set-points queued until the drive takes them"};
    hal::Out<bool> homed{*this, "homed", "homed since the node was last lost"};
    hal::Out<bool> homing{*this, "homing", "homing in progress"};
    hal::Out<std::int32_t> mode_fb{*this, read, "mode-fb", "mode displayed by the drive"};
    hal::Out<bool> warning{*this, read, "warning", "statusword bit 7"};
    hal::Out<bool> remote{*this, read, "remote",
                          "statusword bit 9: the drive is controlled over the bus"};
    hal::Out<bool> voltage{*this, read, "voltage-enabled",
                           "statusword bit 4: the power stage has voltage"};
    hal::Out<bool> limited{*this, read, "internal-limit", "statusword bit 11"};

    // The drive's side, named as CiA 402 names the objects.
    hal::In<bool> operational{
        *this,
        "operational",
        "the node is operational; connect it to the `operational` pin of the bus component",
        {.initial = true}};
    hal::In<std::uint32_t> statusword{*this, "statusword", "6041h"};
    hal::In<std::int32_t> mode_display{*this, "modes-of-operation-display",
                                       "6061h; unlinked: mode changes are not checked"};
    hal::In<std::int32_t> position{*this, "position-actual-value", "6064h"};
    hal::In<std::int32_t> velocity{*this, "velocity-actual-value", "606Ch; optional"};
    hal::In<std::int32_t> vl_velocity{*this, "vl-velocity-actual-value",
                                      "6044h; if linked, source of velocity-fb in mode vl"};
    hal::In<std::int32_t> torque{*this, "torque-actual-value", "6077h"};
    hal::In<std::uint32_t> probe_status{*this, "touch-probe-status", "60B9h; optional"};
    hal::In<std::uint32_t> error_code{*this, "error-code",
                                      "603Fh, or the emcy pin of the node; optional"};
    hal::Out<std::uint32_t> controlword{
        *this, "controlword", "6040h", {.safe = std::uint32_t{hal::cia402::command::quick_stop}}};
    hal::Out<std::int32_t> mode_out{*this, "modes-of-operation", "6060h"};
    hal::Out<std::int32_t> target_position{*this, "target-position", "607Ah"};
    hal::Out<std::int32_t> target_velocity{*this, "target-velocity", "60FFh", {.safe = 0}};
    hal::Out<std::int32_t> target_torque{*this, "target-torque", "6071h", {.safe = 0}};
    hal::Out<std::int32_t> vl_target{*this, "vl-target-velocity", "6042h", {.safe = 0}};
    hal::Out<std::int32_t> velocity_offset{*this, "velocity-offset", "60B1h", {.safe = 0}};
    hal::Out<std::int32_t> torque_offset{*this, "torque-offset", "60B2h", {.safe = 0}};
    hal::Out<std::int32_t> interpolation{*this, "interpolation-data-record", "60C1h:1"};
    hal::Out<std::uint32_t> probe_function{*this, "touch-probe-function", "60B8h", {.safe = 0U}};
    hal::Out<std::uint32_t> profile_velocity{*this, "profile-velocity", "6081h"};
    hal::Out<std::uint32_t> profile_acceleration{*this, "profile-acceleration", "6083h"};
    hal::Out<std::uint32_t> profile_deceleration{*this, "profile-deceleration", "6084h"};

    ProbePins probe_1{*this, 1};
    ProbePins probe_2{*this, 2};

    hal::Emergency off{
        *this, &Cia402::interrupt,
        "disables the axis: when the thread runs again, enable needs another rising edge"};

    void start() { faults_ = hal::extension<hal_faults>("hal.faults/1"); }

    void interrupt(hal::Cycle) noexcept { interrupted_.store(true, std::memory_order_release); }

    void read_all(hal::Cycle cycle) noexcept {
        reads_.ran(cycle.period_ns());
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
        const std::uint32_t probes = probe_status;
        probe_1.read(operational, static_cast<std::uint8_t>(probes), axis_, rules_);
        probe_2.read(operational, static_cast<std::uint8_t>(probes >> 8), axis_, rules_);
        mode_fb = static_cast<std::int32_t>(in.mode);
        warning = (in.statusword & status::warning) != 0;
        remote = (in.statusword & status::remote) != 0;
        voltage = (in.statusword & status::voltage_enabled) != 0;
        limited = (in.statusword & status::internal_limit) != 0;
        const bool unwritten = writes_.is_missing(cycle.period_ns());
        record_lasting(unwritten_record_, unwritten, unwritten_text_);
        if (unwritten) {  // the drive must not keep the last orders
            axis_.set_missing(Cause::unwritten);
            act(cycle);
        }
    }

    void write_all(hal::Cycle cycle) noexcept {
        writes_.ran(cycle.period_ns());
        const bool unread = reads_.is_missing(cycle.period_ns());
        record_lasting(unread_record_, unread, unread_text_);
        axis_.set_missing(unread ? Cause::unread : Cause::none);
        act(cycle);
    }

private:
    /// Commands the axis by the input pins, and shows its state and its failure. [realtime]
    void act(hal::Cycle cycle) noexcept {
        AxisCommand c;
        c.enable = enable;
        c.reset = reset;
        c.quick_stop = quick_stop;
        c.halt = halt;
        c.home = home;
        c.go = go;
        c.relative = relative;
        c.immediate = immediate;
        c.blend = blend;
        c.mode = static_cast<Mode>(mode.get());
        c.position = position_cmd;
        c.velocity = velocity_cmd;
        c.torque = torque_cmd;
        c.profile_velocity = max_velocity;
        c.profile_acceleration = max_acceleration;
        c.profile_deceleration = max_deceleration != 0.0 && !std::isnan(max_deceleration)
                                     ? max_deceleration.get()
                                     : max_acceleration.get();
        if (interrupted_.exchange(false, std::memory_order_acquire)) {
            axis_.interrupt();
        }
        tell(axis_.act(c, rules_, cycle.start_ns()));

        enabled = axis_.enabled();
        active = axis_.active();
        fault = axis_.fault();
        const Failure& failure = axis_.failure();
        const bool recorded = failure.cause == Cause::unwritten || failure.cause == Cause::unread;
        if (failure && failure.cause != reported_ && !recorded) {
            fault_record_.begin(faults_, this, made_.find(failure), Sentences::number(failure));
        } else if (!failure && fault_record_.lasts()) {
            fault_record_.end(faults_, this);
        }
        reported_ = failure.cause;
        record_lasting(power_record_, axis_.keeps_power(), power_text_);
        keeps_power = axis_.keeps_power();
        fault_code = static_cast<std::uint32_t>(failure.cause);
        failed_step = static_cast<std::uint32_t>(failure.step);
        state = static_cast<std::uint32_t>(axis_.state());
        following_error = axis_.following_error();
        target_reached = axis_.target_reached();
        set_points = static_cast<std::uint32_t>(axis_.set_points());
        homed = axis_.homed();
        homing = axis_.homing();
        const std::uint32_t second = probe_2.write();
        probe_function = probe_1.write() | second << 8;
    }

    void record_lasting(hal::LastingFault& record, bool lasts, const std::string& text) noexcept {
        if (lasts && !record.lasts()) {
            record.begin(faults_, this, text.c_str());
        } else if (!lasts && record.lasts()) {
            record.end(faults_, this);
        }
    }
    static Time time(double seconds) noexcept {
        constexpr double max = 4e9;  // s, 126 years: the integer holds the sum of two
        return seconds > 0.0
                   ? static_cast<Time>(std::min(seconds, max) * static_cast<double>(one_second))
                   : 0;
    }
    static const Sentences& sentences() {
        static const Sentences all;
        return all;
    }

    /// Reads the parameters. A changed position scale waits until the axis is off: it would move
    /// the target of the drive. An invalid one is a fault of the axis.
    void read_rules() noexcept {
        const Factor wanted{position_scale, position_divisor};
        if (!has_rules_ || !axis_.enabled() || !wanted.sound()) {
            rules_.position = wanted;
            rules_.counter_bits = counter_bits;
            has_rules_ = true;
        }
        const Factor position = rules_.position;
        rules_.velocity =
            velocity_scale != 0.0 ? Factor{velocity_scale, velocity_divisor} : position;
        rules_.acceleration = acceleration_scale != 0.0
                                  ? Factor{acceleration_scale, acceleration_divisor}
                                  : rules_.velocity;
        rules_.torque = {torque_scale, 1.0};
        rules_.vl = {vl_scale, 1.0};
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
    hal::LastingFault fault_record_, unwritten_record_, unread_record_, power_record_;
    const std::string name_ = hal::own_name("cia402.0");
    const std::string unwritten_text_ =
        hal::missing_function_text(name_ + ".read-all", name_ + ".write-all", "axis stopped");
    const std::string unread_text_ =
        hal::missing_function_text(name_ + ".write-all", name_ + ".read-all", "axis stopped");
    const std::string power_text_ =
        "the drive has power although it was commanded off; remove its power by other means";
    hal::FunctionMonitor reads_, writes_;
    const Sentences& made_ = sentences();
    Axis axis_;
    AxisRules rules_;
    bool has_rules_ = false;
    Cause reported_ = Cause::none;
    // set by interrupt() in any thread, taken by act()
    std::atomic<bool> interrupted_{false};
    hal::Retained retained_{*this, {{"axis", axis_}, {"interrupted", interrupted_}}};
};

}  // namespace

HAL_COMPONENT(Cia402, "cia402",
              "One axis of a CiA 402 drive: states, modes, homing, units, supervision", R"(
The master's side of a servo drive on any bus: the process data of the drive on one side, an axis in
user units on the other. It tracks the state machine of the drive and steps it towards the commanded
state, one transition per cycle.

* `enable` steps the drive to *operation enabled*. If the drive does not make a transition within
  `step-timeout`, the axis is in fault and `show fault` names the transition:
  `x: enable: drive stays in "switched on" after "enable operation" for 2 s`. FALSE brakes on the
  drive's ramp and disables the axis; TRUE before that has finished enables it again.
* While the axis is not enabled, the position sent to the drive is the measured one, so the axis
  does not jump when it is enabled. A drive that is still in *operation enabled* keeps the last
  commanded position: the measured one would be a step back by the lag. Let `position-cmd` track
  `position-fb` while `active` is FALSE. If the two differ at enabling by more than `max-step`,
  enabling is rejected; with `max-step` 0, the difference is blended out over `blend-time`.
* While `operational` is FALSE the controlword is quick stop: the feedback of the drive is lost, but
  it may still receive.
* A fault (see the table) brakes with quick stop in the same cycle, disables the axis and stays
  until a rising edge of `reset`. After a fault, after `quick-stop` and after the node was lost,
  `enable` needs another rising edge. At start-up and after a stop, `enable` waits until the node is
  operational.
* When `read-all` or `write-all` has not run for 100 cycles of the other one, the axis is in fault
  and brakes with quick stop, and `show fault` names the missing function. The fault of an axis that
  was off ends when both run again.
* `keeps-power` is TRUE, and a fault is raised, when a drive does not obey: it is still in
  *operation enabled*, *quick stop active* or *fault reaction active* after `stop-timeout` of a
  command to disable, or `step-timeout` of a quick stop. No further command is left then: connect
  the pin to what removes the power by other means, such as a contactor. On CANopen, `restart` of
  the node is one more try: it resets the drive by NMT, which does not depend on its PDOs.
  `keeps-power` stays TRUE until the drive is seen without power or is enabled again.
* When the thread is stopped (`stop`, an exception, a hang, a suspended process), the axis is
  disabled without a fault. When the thread runs again, the axis stays off until `enable` has
  another rising edge. An edge while the thread is stopped counts: the axis is enabled when it runs
  again. `reload cia402` acts like such a stop and keeps a fault.
* `mode` may change at any time; the command is followed once the drive displays the new mode.
* `halt` brakes on the drive's ramp in modes 1 to 7. In the cyclic modes the target freezes, or
  drops to 0, at once: bring the command to rest first.
* `home` selects mode hm, starts homing as configured in the drive's objects 6098h, 6099h and 609Ah,
  waits for its end, and returns to `mode`. Then `position-fb` is the position counted by the drive.
* `position-fb` = counts * `position-scale-divisor` / `position-scale`; it does not wrap with the
  drive's counter.
* A change of `position-scale`, `position-scale-divisor` or `counter-bits` applies while the axis is
  not enabled, and waits for that otherwise: it would move the target of the drive. 0 or NaN is a
  fault at once.
* A position so far away that the drive's counter would show the same for the other direction (half
  its range, 2^31 counts with 32 `counter-bits`) is a fault: a `position-cmd` that far from the
  position of the drive or from the command of the cycle before, a set-point that far from the
  previous one, a relative one of that distance.

The drive latches positions at its touch probes (60B8h to 60BDh) by itself, between two cycles:

* `probe-1-enable` arms probe 1. At the first rising edge of its input, `probe-1-latched` becomes
  TRUE, and `probe-1-position` is the position of the edge. `probe-1-falling` selects the falling
  edge, `probe-1-index` the index pulse of the encoder. With `probe-1-continuous`,
  `probe-1-position` follows each further edge. Probe 2 has the same pins.
* A rising edge of `probe-1-enable` arms the probe again, and so does another selection. What was
  latched before does not count.
* `probe-1-armed` stays FALSE while the drive does not report the probe as enabled.
  `touch-probe-function`, `touch-probe-status` and the positions of the edges must be in the process
  data.
* For LinuxCNC, link `probe-1-latched` to `motion.probe-input`. Motion takes the position of its own
  cycle; `probe-1-position` is the exact one.

Call `read-all` after the function that receives from the bus and `write-all` before the one that
sends, with the controller of the axis between the two.


| mode | name | follows |
| --- | --- | --- |
| 1 | pp, profile position | `position-cmd` at each rising edge of `go` |
| 2 | vl, velocity | `velocity-cmd` |
| 3 | pv, profile velocity | `velocity-cmd` |
| 4 | tq, profile torque | `torque-cmd` |
| 6 | hm, homing | `home` |
| 7 | ip, interpolated position | `position-cmd` |
| 8 | csp, cyclic synchronous position | `position-cmd`; `velocity-cmd` and `torque-cmd` as feed-forward |
| 9 | csv, cyclic synchronous velocity | `velocity-cmd`; `torque-cmd` as feed-forward |
| 10 | cst, cyclic synchronous torque | `torque-cmd` |

| fault-code | cause |
| --- | --- |
| 0 | none |
| 1 | the drive did not make a state transition: `failed-step` |
| 2 | the drive is in fault: `error-code` |
| 3 | the drive left *operation enabled* without a command |
| 4 | the node is no longer operational |
| 5 | the drive does not display the commanded mode |
| 6 | following error above `max-following-error` |
| 7 | `position-cmd` stepped farther than `max-step`, or was that far from `position-fb` at enabling |
| 8 | a command is not a number, or too large: a position half the range of the drive's counter away, a velocity or torque that the drive's object cannot hold |
| 9 | a scale is 0 or not a number |
| 10 | the drive reports a homing error |
| 11 | homing took longer than `homing-timeout` |
| 12 | pp: the drive did not acknowledge a set-point |
| 13 | `home` or `go` without `enabled` |
| 14 | `write-all` does not run |
| 15 | `read-all` does not run |
| 16 | pp: 16 set-points were queued already; the new one is lost |
| 17 | `max-step` or `max-following-error` is negative |

`failed-step`: 0 wait, 1 shutdown, 2 switch on, 3 enable operation, 4 disable operation, 5 disable
voltage, 6 quick stop, 7 fault reset. `state`: 0 not ready to switch on, 1 switch on disabled, 2
ready to switch on, 3 switched on, 4 operation enabled, 5 quick stop active, 6 fault reaction
active, 7 fault, 8 none of these.

Coming from LinuxCNC's component of the same name: `pos-cmd`, `pos-fb`, `velocity-cmd`, `opmode`,
`opmode-display`, `drv-actual-position`, `drv-target-position`, `pos-scale` and `stat-*` are
`position-cmd`, `position-fb`, `velocity-cmd`, `modes-of-operation`, `modes-of-operation-display`,
`position-actual-value`, `target-position`, `position-scale`, and `state` with the related pins;
`csp-mode` is `mode` 8 or 9.

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
