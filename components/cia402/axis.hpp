// SPDX-License-Identifier: MIT
// The master's side of one axis of CiA 402. It knows no bus: feedback of the drive goes in, orders
// to the drive come out, as raw values. CANopen PDOs, SDOs or EtherCAT transport them.
//
//     Axis axis;
//     each cycle:
//         const AxisOrders& out = axis.step(feedback, command, rules, now);
//         if (axis.failure()) ...  // text(axis.failure()) explains it
#pragma once

#include "axis_failure.hpp"
#include "axis_motion.hpp"
#include "axis_units.hpp"
#include "axis_walk.hpp"

namespace hal::cia402 {

/// Feedback of the drive, in its units.
struct AxisFeedback {
    bool operational = true;       ///< the node is operational and sends process data
    std::uint16_t statusword = 0;  ///< 6041h
    std::uint16_t error_code = 0;  ///< 603Fh; 0 if unknown
    Mode mode = Mode::none;        ///< 6061h
    std::int32_t position = 0;     ///< 6064h
    std::int32_t velocity = 0;     ///< 606Ch
    std::int16_t vl_velocity = 0;  ///< 6044h
    std::int16_t torque = 0;       ///< 6077h
    bool has_mode = true;
    bool has_velocity = true;
    bool has_vl_velocity = false;  ///< the drive sends them
};

/// Orders to the drive, in its units.
struct AxisOrders {
    std::uint16_t controlword = 0;  ///< 6040h
    Mode mode = Mode::none;  ///< 6060h; none: unchanged
    std::int32_t target_position = 0;  ///< 607Ah
    std::int32_t interpolation = 0;  ///< 60C1h:1
    std::int32_t target_velocity = 0;  ///< 60FFh
    std::int16_t vl_target_velocity = 0;  ///< 6042h
    std::int16_t target_torque = 0;  ///< 6071h
    std::int32_t velocity_offset = 0;  ///< 60B1h
    std::int16_t torque_offset = 0;  ///< 60B2h
    std::uint32_t profile_velocity = 0;  ///< 6081h
    std::uint32_t profile_acceleration = 0;
    std::uint32_t profile_deceleration = 0;  ///< 6083h, 6084h
};

/// Commands to the axis, in user units.
struct AxisCommand {
    /// a rising edge enables, false disables; after a failure another edge is needed
    bool enable = false;
    bool quick_stop = false;
    bool halt = false;  ///< brake to standstill and stay enabled
    bool reset = false;  ///< a rising edge clears a failure and the fault of the drive
    bool home = false;  ///< a rising edge starts homing, false aborts it
    /// pp: a rising edge makes position a new set-point, with the three flags
    bool go = false;
    bool relative = false;
    bool immediate = false;
    bool blend = false;
    Mode mode = Mode::none;  ///< none: that of the drive
    double position = 0.0;  ///< csp, ip, pp
    double velocity = 0.0;  ///< csv, pv, vl; csp: feed-forward
    double torque = 0.0;  ///< cst, tq; csp, csv: feed-forward
    /// of moves planned by the drive
    double profile_velocity = 0.0;
    double profile_acceleration = 0.0;
    double profile_deceleration = 0.0;
};

/// Configuration of the axis; may change at any time.
struct AxisRules {
    Factor position;  ///< counts per unit
    Factor velocity;  ///< drive's velocity units per unit/s
    Factor acceleration;  ///< drive's acceleration units per unit/s²
    Factor torque;  ///< 1/1000 of the rated torque per unit
    Factor vl;  ///< units of mode vl (r/min) per unit/s
    unsigned counter_bits = 32;  ///< valid bits of the drive's position counter
    Walk::Limits limits{};
    Time homing = 0;  ///< timeout of homing, ns; 0: none
    /// with max_step 0: time to blend out a command away from the axis at enabling, ns
    Time blend = one_second / 2;
    /// largest step of position in one cycle, units; 0: not checked, negative: a failure
    double max_step = 0.0;
    double max_following_error = 0.0;  ///< units; 0: not checked, negative: a failure
    bool auto_reset = false;  ///< enable also resets a failure
};

/// The axis. All functions are called by one thread, in its cycle. [realtime]
class Axis {
public:
    /// Runs one cycle at `now` (ns). The result is valid until the next call. [realtime]
    const AxisOrders& step(const AxisFeedback& feedback, const AxisCommand& command,
                           const AxisRules& rules, Time now) noexcept {
        observe(feedback, rules, now);
        return act(command, rules, now);
    }
    /// The two halves of step(), for a caller that computes the command from the feedback in
    /// between. [realtime]
    void observe(const AxisFeedback&, const AxisRules&, Time now) noexcept;
    const AxisOrders& act(const AxisCommand&, const AxisRules&, Time now) noexcept;

    /// Reports which half of step() is missing: `unwritten` (the caller of act()), `unread` (the
    /// caller of observe()), `none`. Without one of them the axis fails, brakes with quick stop and
    /// cannot be enabled; the remaining caller calls act(). The failure of an axis that was off
    /// ends when both run again. [realtime]
    void set_missing(Cause half) noexcept;

    /// Disables the axis after a time without cycles, in which the drive was stopped. This is not a
    /// failure; enable needs another edge. The bus may have been stopped, too: in the first second
    /// of cycles, and until the drive has been enabled, the first loss of the node is not a failure
    /// either, and enabling waits for its return. [realtime]
    void interrupt() noexcept;

    State state() const noexcept { return walk_.state(); }
    bool enabled() const noexcept { return enabled_; }
    /// Returns true while commands are followed: enabled, in the commanded mode, not homing. While
    /// false, let the position command track the feedback.
    bool active() const noexcept { return active_; }
    /// Returns true while a commanded change of state is in progress.
    bool walking() const noexcept { return !walk_.reached(); }
    /// Returns true while the drive has power although it was commanded off or to stop and the
    /// timeout has expired: its power must be removed by other means.
    bool keeps_power() const noexcept { return walk_.keeps_power(); }
    bool homed() const noexcept { return homed_; }
    bool homing() const noexcept { return home_ != Home::no; }
    bool fault() const noexcept {
        return failure_ || walk_.state() == State::fault ||
               walk_.state() == State::fault_reaction_active;
    }
    /// Returns why the axis was disabled or rejected a command; kept until reset.
    const Failure& failure() const noexcept { return failure_; }

    /// does not wrap with the drive's counter
    double position() const noexcept { return position_; }
    /// Returns where a reading of the drive's counter is that lies within half its range of the
    /// present one, in user units: a latched position. The present one, if the scale is invalid.
    double position_of(std::int32_t reading, const AxisRules& rules) const noexcept {
        if (!rules.position.sound()) return position_;
        return rules.position.to_user(
            static_cast<double>(counter_.count_of(reading, rules.counter_bits)));
    }
    double velocity() const noexcept { return velocity_; }
    double torque() const noexcept { return torque_; }
    /// position sent to the drive; while not active, the feedback
    double commanded() const noexcept { return commanded_; }
    double following_error() const noexcept { return commanded_ - position_; }
    /// Returns true in pp when all set-points are done; in other modes the target reached bit (bit
    /// 10).
    bool target_reached() const noexcept { return target_reached_; }
    /// queued until the drive takes them
    std::size_t set_points() const noexcept { return set_points_.waiting(); }

private:
    enum class Home : std::uint8_t { no, entering, running, leaving };
    /// After a time without cycles: before the first cycle; feedback may be from before the stop.
    enum class Restart : std::uint8_t { no, pending, recent };

    void follow_restart(Time now) noexcept;
    void decide(const AxisCommand&, const AxisRules&) noexcept;
    void walk(const AxisCommand&, const AxisRules&, Time now) noexcept;
    void watch_enabled(State, const AxisRules&, Time now) noexcept;
    void want_state(State, bool quick_stop) noexcept;
    void take_failures(State) noexcept;
    void stop_now(const AxisCommand&, const AxisRules&, Time now) noexcept;
    void select_mode(const AxisCommand&, const AxisRules&, Time now) noexcept;
    void request_enable(const AxisRules&) noexcept;
    void lose_drive() noexcept;
    void note_disable(Time now) noexcept;
    void home(const AxisCommand&, const AxisRules&, Time now) noexcept;
    void request_homing() noexcept;
    void leave_homing() noexcept;
    void run_homing(const AxisCommand&, const AxisRules&, Time now) noexcept;
    void adopt_failure(const Failure&) noexcept;
    static bool is_too_far(double position, const AxisRules&) noexcept;
    bool is_unreachable(const AxisCommand&, double count, const AxisRules&) const noexcept;
    void reject_step(double step, double max_step) noexcept;
    void follow_position(const AxisCommand&, const AxisRules&, Time now) noexcept;
    void check_numbers(const AxisCommand&, const AxisRules&) noexcept;
    void move(const AxisCommand&, const AxisRules&, Time now) noexcept;
    void follow_target(bool by_cycle) noexcept;
    void move_by_position(const AxisCommand& command, const AxisRules& rules, Time now) noexcept;
    void move_by_set_points(const AxisCommand& command, const AxisRules& rules, Time now) noexcept;
    void queue_set_point(const AxisCommand& command, const AxisRules& rules) noexcept;
    void set_velocity_and_torque(const AxisCommand& command, const AxisRules& rules) noexcept;
    void set_mode_bits(const AxisCommand& command) noexcept;
    void fail(Cause, Request) noexcept;
    void fail(Cause, double value, double limit) noexcept;

    Walk walk_;
    SetPoints set_points_;
    HomingRun homing_run_;
    Counter counter_;
    Failure failure_;
    Cause missing_ = Cause::none;
    AxisFeedback in_;
    AxisOrders orders_;

    double position_ = 0.0;
    double velocity_ = 0.0;
    double torque_ = 0.0;
    double commanded_ = 0.0;
    double last_position_ = 0.0;
    // the command of the last cycle; its distance from the feedback at enabling
    double joined_ = 0.0;
    double offset_ = 0.0;
    double last_set_point_ = 0.0;  // pp: where the queued set-points end, in counts
    Time last_ = 0;
    Time mode_since_ = 0;
    Time joined_at_ = 0;
    Time disable_sent_at_ = 0;
    Time restarted_at_ = 0;
    Restart restart_ = Restart::no;
    Home home_ = Home::no;
    unsigned home_cycles_ = 0;
    bool failed_while_off_ = false;
    bool wanted_ = false;
    bool enabled_ = false;
    bool active_ = false;
    bool homed_ = false;
    bool following_ = false;
    bool holds_target_ = false;  // the drive obeys the last commanded position

    bool mode_shown_ = false;
    bool was_enable_ = false;
    bool was_reset_ = false;
    bool was_home_ = false;
    bool was_go_ = false;

    bool was_operational_ = false;
    bool started_ = false;
    bool target_reached_ = false;
    bool jumped_ = false;
    bool disable_sent_ = false;  // and the drive has not been seen disabled since
};

}  // namespace hal::cia402
