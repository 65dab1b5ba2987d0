// SPDX-License-Identifier: MIT
// The drive's state machine seen from the master: a state is wanted, and the statusword shows the way there, a transition per cycle.
#pragma once

#include "axis_failure.hpp"

namespace hal::canopen::cia402 {

class Walk {
public:
    /// Where to go: switch on disabled, ready to switch on, switched on, operation enabled or quick stop active. Asking for what is
    /// wanted already changes nothing; else the clock of the step starts anew and the failure is forgotten. [realtime]
    void want(State wanted, Request request) noexcept;
    State wanted() const noexcept { return wanted_; }
    /// A rising edge of fault reset is given while the drive is in fault. [realtime]
    void reset_fault() noexcept;

    struct Limits {
        Time step = 2 * one_second;   ///< for a transition
        Time stop = 10 * one_second;  ///< for one before which the drive brakes: disable operation, quick stop
    };
    /// Once per cycle: bits 0–3 and 7 of the controlword. [realtime]
    std::uint16_t step(std::uint16_t statusword, std::uint16_t error_code, Time now, const Limits&) noexcept;

    State state() const noexcept { return state_; }
    bool resetting() const noexcept { return resetting_; }
    /// The drive is where it should be. When it should be off, also in fault or still starting: no power reaches the motor.
    bool reached() const noexcept { return reached_; }
    /// Why it does not go on; it has stopped trying, unless it is to be off.
    const Failure& failure() const noexcept { return failure_; }

private:
    void fail(Cause, std::uint16_t statusword, std::uint16_t error_code, Time waited) noexcept;

    State wanted_ = State::switch_on_disabled, state_ = State::unknown;
    Request request_ = Request::disable;
    Step step_ = Step::wait, led_ = Step::wait;  // commanded now; the last that was no waiting
    Failure failure_;
    Time since_ = 0;
    bool fresh_ = true, reached_ = false, resetting_ = false, edge_low_ = false;
    bool forced_ = false;  // the gentle way took too long: its voltage is disabled
};

}  // namespace hal::canopen::cia402
