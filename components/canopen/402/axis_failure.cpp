// SPDX-License-Identifier: MIT
#include "axis_failure.hpp"

#include <cstdarg>
#include <cstdio>

#include "canopen/301/emcy.hpp"

namespace hal::canopen::cia402 {

namespace {

[[gnu::format(printf, 1, 2)]] std::string print(const char* format, ...) {
    char text[256];
    va_list arguments;
    va_start(arguments, format);
    std::vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return text;
}

std::string quoted(const char* text) { return std::string("\"") + text + "\""; }
double seconds(Time t) { return static_cast<double>(t) / static_cast<double>(second); }

/// A mode as people write it, or its number.
std::string name(Mode mode) {
    return mode == Mode::none || *abbreviation(mode) != '-' ? std::string(abbreviation(mode)) : std::to_string(static_cast<int>(mode));
}

std::string state_words(State state) { return state == State::unknown ? "no state of CiA 402" : quoted(word(state)); }

std::string after(Step step) { return step == Step::wait ? "" : " after " + quoted(word(step)); }

std::string error_words(std::uint16_t code) {
    if (code == 0) return "";
    const char* const own = error_word(code);
    return print(", error 0x%04X: ", code) + (own ? own : emergency_word(code));
}

/// What the other bits of the statusword say about it.
std::string hint(const Failure& f) {
    if (f.statusword == 0) return "; was a statusword received at all?";
    if ((f.statusword & status::remote) == 0 && f.cause == Cause::stays) return "; remote is 0: the drive obeys its own panel";
    if ((f.statusword & status::voltage_enabled) == 0 && f.cause == Cause::stays && f.request == Request::enable)
        return "; voltage-enabled is 0: has its power stage supply?";
    return "";
}

}  // namespace

const char* word(Request request) noexcept {
    constexpr const char* words[] = {"enable", "run", "disable", "quick stop", "reset", "mode", "home", "go"};
    return words[static_cast<unsigned>(request)];
}

const char* word(Step step) noexcept {
    constexpr const char* words[] = {"wait", "shutdown", "switch on", "enable operation", "disable operation", "disable voltage",
                                     "quick stop", "fault reset"};
    return words[static_cast<unsigned>(step)];
}

std::string sentence(const Failure& f) {
    const std::string asked = std::string(word(f.request)) + ": ";
    switch (f.cause) {
    case Cause::none: return "";
    case Cause::stays:
        return asked + (f.state == State::unknown ? "drive shows " : "drive stays in ") + state_words(f.state) + after(f.step);
    case Cause::drive_fault:
        return asked + (f.step != Step::wait || f.request == Request::run ? "drive went into fault" + after(f.step) : "drive is in fault");
    case Cause::left:
        return asked + "drive left " + quoted(word(f.before)) + " for " + state_words(f.state) + " without being told";
    case Cause::lost: return asked + "drive lost: its node is not operational any more";
    case Cause::mode_refused: return asked + "drive does not take mode " + name(f.mode) + ", it shows " + name(f.shown);
    case Cause::following_error: return asked + "following error above max-following-error";
    case Cause::step_refused:
        return asked + (f.step == Step::wait ? "position-cmd steps farther than max-step"
                                             : "position-cmd is farther from position-fb than max-step");
    case Cause::bad_command: return asked + "the command is not a number, or too large";
    case Cause::bad_factor: return asked + "a scale is 0 or not a number";
    case Cause::homing_error: return asked + "drive reports " + quoted(word(homing_of(f.statusword)));
    case Cause::homing_late: return asked + "not attained in time";
    case Cause::set_point:
        return asked + ((f.statusword & status::set_point_acknowledge) == 0 ? "drive does not acknowledge the set-point"
                                                                            : "drive does not take its acknowledge back");
    case Cause::not_enabled: return asked + "the axis is not enabled";
    }
    return asked + "failed";
}

std::string text(const Failure& f) {
    std::string all = sentence(f);
    if (f.cause == Cause::stays || f.cause == Cause::mode_refused || f.cause == Cause::homing_late || f.cause == Cause::set_point)
        all += print(" for %.2f s", seconds(f.after));
    if (f.cause == Cause::following_error || f.cause == Cause::step_refused) return all + print(" (%g, limit %g)", f.value, f.limit);
    if (f.cause == Cause::bad_command || f.cause == Cause::bad_factor) return all + print(" (%g)", f.value);
    if (f.cause == Cause::none || f.cause == Cause::lost || f.cause == Cause::not_enabled) return all;
    return all + print(" (statusword 0x%04X", f.statusword) + error_words(f.error_code) + ")" + hint(f);
}

}  // namespace hal::canopen::cia402
