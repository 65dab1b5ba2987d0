// SPDX-License-Identifier: MIT
// Why an axis does not follow its commands: numbers in the cycle, messages outside.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drive_profile.hpp"

namespace hal::cia402 {

/// Returns whether the motor may have power in a state of the drive. [any]
bool has_power(State) noexcept;

/// The command that failed.
enum class Request : std::uint8_t { enable, run, disable, quick_stop, reset, mode, home, go };
/// Returns the name of a request, as in "quick stop". [any]
const char* to_string(Request) noexcept;

/// The transition that a controlword commands.
enum class Step : std::uint8_t {
    wait,  ///< for an automatic transition of the drive
    shutdown,
    switch_on,
    enable_operation,
    disable_operation,
    disable_voltage,
    quick_stop,
    fault_reset,
};
/// Returns the name of a step, as in "enable operation". [any]
const char* to_string(Step) noexcept;

/// Cause of a failure, published as pin `fault-code` of component cia402: never renumber.
enum class Cause : std::uint8_t {
    none = 0,
    stays = 1,            ///< the drive did not make a state transition
    drive_fault = 2,      ///< the drive is in fault
    left = 3,             ///< the drive left operation enabled without a command
    lost = 4,             ///< the node is no longer operational
    mode_rejected = 5,     ///< the drive does not display the commanded mode
    following_error = 6,
    step_rejected = 7,     ///< the step of position-cmd is too large
    /// not a number, beyond the range of the counts, or so far that its direction is unclear
    bad_command = 8,
    bad_factor = 9,       ///< a factor is 0 or not a number
    homing_error = 10,    ///< reported by the drive
    homing_timeout = 11,
    set_point = 12,       ///< pp: not acknowledged
    not_enabled = 13,     ///< commanded to move while not enabled
    unwritten = 14,       ///< the function that sends the orders does not run
    unread = 15,          ///< the function that reads the feedback does not run
    set_point_lost = 16,  ///< pp: no space for another set-point
    bad_limit = 17,       ///< the limit of a supervision is negative
};
inline constexpr unsigned causes = 18;

/// A failure, as stored in the cycle.
struct Failure {
    Cause cause = Cause::none;
    Request request = Request::enable;
    Step step = Step::wait;
    State state = State::unknown;           ///< of the drive at the time
    State before = State::unknown;          ///< left: the state it left
    Mode mode = Mode::none;
    Mode shown = Mode::none;  ///< commanded, and displayed
    std::uint16_t statusword = 0;
    std::uint16_t error_code = 0;           ///< 603Fh; 0: unknown
    Time after = 0;                         ///< time waited, ns
    double value = 0.0;
    double limit = 0.0;        ///< user units

    explicit operator bool() const noexcept { return cause != Cause::none; }
};

/// Returns the message without the numbers that change. [setup]
std::string sentence(const Failure&);
/// Returns the message with all numbers, and a hint. [setup]
std::string text(const Failure&);

/// All messages, formatted in advance for a cycle that raises faults by hal.faults/1: "{}" or "{x}"
/// stands for the number.
class Sentences {
public:
    /// Formats all messages. [setup]
    Sentences();
    /// Returns the message of a failure, valid as long as this object. [realtime]
    const char* find(const Failure&) const noexcept;
    /// Returns the number to raise with it. [realtime]
    static double number(const Failure&) noexcept;

private:
    std::vector<std::uint32_t> keys_;  // sorted, in the order of texts_
    std::vector<std::string> texts_;
};

}  // namespace hal::cia402
