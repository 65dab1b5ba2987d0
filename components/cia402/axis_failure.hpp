// SPDX-License-Identifier: MIT
// Why an axis does not do what was asked: kept as numbers in the cycle, worded outside.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drive_profile.hpp"

namespace hal::canopen::cia402 {

/// What the master asks for.
enum class Request : std::uint8_t { enable, run, disable, quick_stop, reset, mode, home, go };
const char* word(Request) noexcept;

/// What a controlword commands.
enum class Step : std::uint8_t {
    wait,  ///< for the drive to go on by itself
    shutdown, switch_on, enable_operation, disable_operation, disable_voltage, quick_stop, fault_reset,
};
const char* word(Step) noexcept;

/// Published as pin `fault-code` of component cia402: never renumber.
enum class Cause : std::uint8_t {
    none = 0,
    stays = 1,            ///< a step of the walk was not taken
    drive_fault = 2,      ///< the drive is in fault
    left = 3,             ///< the drive left operation enabled without being told
    lost = 4,             ///< its node is not operational any more
    mode_refused = 5,     ///< the mode display does not follow
    following_error = 6,
    step_refused = 7,     ///< position-cmd steps too far
    bad_command = 8,      ///< not a number, or beyond all counts
    bad_factor = 9,       ///< a factor is 0 or not a number
    homing_error = 10,    ///< the drive reports it
    homing_late = 11,
    set_point = 12,       ///< pp: not acknowledged
    not_enabled = 13,     ///< asked to move without
};
inline constexpr unsigned causes = 14;

struct Failure {
    Cause cause = Cause::none;
    Request request = Request::enable;
    Step step = Step::wait;
    State state = State::unknown;           ///< of the drive, then
    State before = State::unknown;          ///< left: what it should have stayed in
    Mode mode = Mode::none, shown = Mode::none;  ///< asked for, and the display
    std::uint16_t statusword = 0;
    std::uint16_t error_code = 0;           ///< 603Fh; 0: not known
    Time after = 0;                         ///< how long was waited
    double value = 0.0, limit = 0.0;        ///< user units

    explicit operator bool() const noexcept { return cause != Cause::none; }
};

/// What failed, as a sentence without the numbers that change. [setup]
std::string sentence(const Failure&);
/// With all numbers and what they hint at. [setup]
std::string text(const Failure&);

/// Every sentence there is, made beforehand, for a cycle that reports failures to hal.faults/1: {} or {x} in it is where the number goes.
class Sentences {
public:
    Sentences();  // [setup]
    /// Good as long as this. [realtime]
    const char* find(const Failure&) const noexcept;
    static double number(const Failure&) noexcept;

private:
    std::vector<std::uint32_t> keys_;  // sorted, in the order of texts_
    std::vector<std::string> texts_;
};

}  // namespace hal::canopen::cia402
