// SPDX-License-Identifier: MIT
// The drive's state machine seen from the master: steps it to a commanded state, one transition per
// cycle.
#pragma once

#include "axis_failure.hpp"

namespace hal::cia402 {

/// Walks the state machine. All functions are called by one thread.
class Walk {
public:
    /// Commands a state: switch on disabled, ready to switch on, switched on, operation enabled or
    /// quick stop active. Repeating the command has no effect; a new one restarts the timeout and
    /// clears the failure. [realtime]
    void want(State wanted, Request request) noexcept;
    /// Counts the timeout of the current transition from the next step on, after a time without
    /// cycles. [realtime]
    void restart_timeout() noexcept { fresh_ = true; }
    State wanted() const noexcept { return wanted_; }
    /// Sends a rising edge of fault reset while the drive is in fault. [realtime]
    void reset_fault() noexcept;

    struct Limits {
        Time step = 2 * one_second;  ///< timeout of a transition, ns
        /// timeout of a transition with braking (disable operation, quick stop), ns
        Time stop = 10 * one_second;
    };
    /// Runs one cycle at `now` (ns). Returns bits 0..3 and 7 of the controlword. [realtime]
    std::uint16_t step(std::uint16_t statusword, std::uint16_t error_code, Time now,
                       const Limits&) noexcept;

    State state() const noexcept { return state_; }
    bool resetting() const noexcept { return resetting_; }
    /// Returns true when the drive is in the commanded state. For switch on disabled, fault and not
    /// ready count, too: the motor has no power.
    bool reached() const noexcept { return reached_; }
    /// Returns true while the drive has power although its time to switch off, or to stop, has
    /// expired: it does not obey. Kept until it is seen without power, or is to be enabled again.
    bool keeps_power() const noexcept { return keeps_power_; }
    /// Returns why it does not proceed. It has stopped trying, unless the commanded state is off.
    const Failure& failure() const noexcept { return failure_; }

    /// A command, or the one that holds the drive where it is to be.
    struct Transition {
        Step step;
        bool there = false;
    };

private:
    bool observe(std::uint16_t statusword) noexcept;
    Transition choose(std::uint16_t statusword, std::uint16_t error_code) noexcept;
    void begin(Step, Time now) noexcept;
    Time timeout(const Limits&) const noexcept;
    void expire(std::uint16_t statusword, std::uint16_t error_code, Time waited) noexcept;
    void fail(Cause, std::uint16_t statusword, std::uint16_t error_code, Time waited) noexcept;

    State wanted_ = State::switch_on_disabled;
    State state_ = State::unknown;
    Request request_ = Request::disable;
    Step step_ = Step::wait;
    Step led_ = Step::wait;  // commanded now; the last other than wait
    Failure failure_;
    Time since_ = 0;
    bool fresh_ = true;
    bool reached_ = false;
    bool resetting_ = false;
    bool edge_low_ = false;
    bool forced_ = false;  // braking took too long: the voltage is disabled
    bool keeps_power_ = false;
};

}  // namespace hal::cia402
