// SPDX-License-Identifier: MIT
// The master's side of one axis of CiA 402. It knows no bus: what the drive says goes in, what it is to be told comes out, as raw
// values, and who carries them (PDOs of CANopen, EtherCAT, SDOs by hand) does not matter.
//
//     Axis axis;
//     each cycle:
//         const AxisOrders& out = axis.step(feedback, command, rules, now);
//         if (axis.failure()) ...  // text(axis.failure()) says why
#pragma once

#include "axis_failure.hpp"
#include "axis_motion.hpp"
#include "axis_units.hpp"
#include "axis_walk.hpp"

namespace hal::canopen::cia402 {

/// What the drive says.
struct AxisFeedback {
    bool operational = true;       ///< its node is there and sends process data
    std::uint16_t statusword = 0;  ///< 6041h
    std::uint16_t error_code = 0;  ///< 603Fh; 0 when not known
    Mode mode = Mode::none;        ///< 6061h
    std::int32_t position = 0;     ///< 6064h
    std::int32_t velocity = 0;     ///< 606Ch
    std::int16_t vl_velocity = 0;  ///< 6044h
    std::int16_t torque = 0;       ///< 6077h
    bool has_mode = true, has_velocity = true, has_vl_velocity = false;  ///< they come at all
};

/// What the drive is told.
struct AxisOrders {
    std::uint16_t controlword = 0;          ///< 6040h
    Mode mode = Mode::none;                 ///< 6060h; none: leave it
    std::int32_t target_position = 0;       ///< 607Ah
    std::int32_t interpolation = 0;         ///< 60C1h:1
    std::int32_t target_velocity = 0;       ///< 60FFh
    std::int16_t vl_target_velocity = 0;    ///< 6042h
    std::int16_t target_torque = 0;         ///< 6071h
    std::int32_t velocity_offset = 0;       ///< 60B1h
    std::int16_t torque_offset = 0;         ///< 60B2h
    std::uint32_t profile_velocity = 0;     ///< 6081h
    std::uint32_t profile_acceleration = 0, profile_deceleration = 0;  ///< 6083h, 6084h
};

/// What is asked of the axis, in user units.
struct AxisCommand {
    bool enable = false;      ///< a rising edge switches on, false off; after a failure it takes another edge
    bool quick_stop = false;
    bool halt = false;        ///< stand still, enabled
    bool reset = false;       ///< a rising edge forgets a failure, and resets the drive's fault
    bool home = false;        ///< a rising edge starts homing, false ends it
    bool go = false;          ///< pp: a rising edge gives position as a new set-point, with the three flags
    bool relative = false, immediate = false, blend = false;
    Mode mode = Mode::none;   ///< none: the one the drive has
    double position = 0.0;    ///< csp, ip, pp
    double velocity = 0.0;    ///< csv, pv, vl; csp: ahead of what the position asks
    double torque = 0.0;      ///< cst, tq; csp, csv: ahead
    double profile_velocity = 0.0, profile_acceleration = 0.0, profile_deceleration = 0.0;  ///< of what the drive plans itself
};

/// How it is done; may change at any time.
struct AxisRules {
    Factor position;      ///< counts per unit
    Factor velocity;      ///< drive's velocity units per unit/s
    Factor acceleration;  ///< drive's acceleration units per unit/s²
    Factor torque;        ///< 1/1000 of the rated torque per unit
    Factor vl;            ///< units of mode vl (r/min) per unit/s
    unsigned counter_bits = 32;        ///< of the drive's position that count
    Walk::Limits limits{};
    Time homing = 0;                   ///< longest; 0: no limit
    Time blend = one_second / 2;           ///< max_step 0: in that time a command that is elsewhere when the axis is enabled is joined
    double max_step = 0.0;             ///< farthest position may go in one cycle; 0: not watched
    double max_following_error = 0.0;  ///< 0: not watched
    bool auto_reset = false;           ///< enable resets a failure
};

class Axis {
public:
    /// One cycle. The answer stays good until the next. [realtime]
    const AxisOrders& step(const AxisFeedback& feedback, const AxisCommand& command, const AxisRules& rules, Time now) noexcept {
        observe(feedback, rules, now);
        return act(command, rules, now);
    }
    /// Its two halves, for whoever makes the command from the feedback in between. [realtime]
    void observe(const AxisFeedback&, const AxisRules&, Time now) noexcept;
    const AxisOrders& act(const AxisCommand&, const AxisRules&, Time now) noexcept;

    State state() const noexcept { return walk_.state(); }
    bool enabled() const noexcept { return enabled_; }
    /// Commands are followed: enabled, in the mode asked for, not homing. While not, position belongs to whoever commands: let it follow.
    bool active() const noexcept { return active_; }
    /// A command to change the state is still under way.
    bool walking() const noexcept { return !walk_.reached(); }
    bool homed() const noexcept { return homed_; }
    bool homing() const noexcept { return home_ != Home::no; }
    bool fault() const noexcept { return failure_ || walk_.state() == State::fault || walk_.state() == State::fault_reaction_active; }
    /// Why it went off or refused, until reset.
    const Failure& failure() const noexcept { return failure_; }

    double position() const noexcept { return position_; }          ///< endless
    double velocity() const noexcept { return velocity_; }
    double torque() const noexcept { return torque_; }
    double commanded() const noexcept { return commanded_; }        ///< the position the drive was told; while not active, the feedback
    double following_error() const noexcept { return commanded_ - position_; }
    /// pp: all set-points are done; else what the drive says (bit 10).
    bool target_reached() const noexcept { return target_reached_; }
    std::size_t set_points() const noexcept { return set_points_.waiting(); }  ///< that wait for room in the drive

private:
    enum class Home : std::uint8_t { no, entering, running, leaving };

    void decide(const AxisCommand&, const AxisRules&) noexcept;
    void walk(const AxisCommand&, const AxisRules&, Time now) noexcept;
    void select_mode(const AxisCommand&, const AxisRules&, Time now) noexcept;
    void home(const AxisCommand&, const AxisRules&, Time now) noexcept;
    void follow_position(const AxisCommand&, const AxisRules&, Time now) noexcept;
    void move(const AxisCommand&, const AxisRules&, Time now) noexcept;
    void fail(Cause, Request) noexcept;
    void fail(Cause, double value, double limit) noexcept;

    Walk walk_;
    SetPoints set_points_;
    HomingRun homing_run_;
    Counter counter_;
    Failure failure_;
    AxisFeedback in_;
    AxisOrders orders_;

    double position_ = 0.0, velocity_ = 0.0, torque_ = 0.0, commanded_ = 0.0, last_position_ = 0.0;
    double joined_ = 0.0, offset_ = 0.0;  // the command of the last cycle; what it was away from the feedback when joined
    Time last_ = 0, mode_since_ = 0, joined_at_ = 0, told_off_at_ = 0;
    Home home_ = Home::no;
    unsigned home_cycles_ = 0;
    bool wanted_ = false, enabled_ = false, active_ = false, homed_ = false, following_ = false, mode_shown_ = false;
    bool was_enable_ = false, was_reset_ = false, was_home_ = false, was_go_ = false, was_operational_ = false, started_ = false;
    bool target_reached_ = false, jumped_ = false;
    bool told_off_ = false;  // and not seen off since
};

}  // namespace hal::canopen::cia402
