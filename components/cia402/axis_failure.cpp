// SPDX-License-Identifier: MIT
#include "axis_failure.hpp"

#include <algorithm>
#include <cstdarg>
#include <cstdio>
#include <limits>

#include "error_words.hpp"

namespace hal::cia402 {

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
double seconds(Time t) { return static_cast<double>(t) / static_cast<double>(one_second); }

constexpr Mode any_other{-128};  // in preformatted messages: a mode without a name

/// Returns the abbreviation of a mode, or its number.
std::string name(Mode mode) {
    if (mode == Mode::none) return "none";
    if (mode == any_other) return "another";
    return *abbreviation(mode) != '-' ? std::string(abbreviation(mode))
                                      : std::to_string(static_cast<int>(mode));
}

std::string commanded_mode(Mode mode) {
    return mode == any_other ? "this number" : "mode " + name(mode);
}

std::string state_words(State state) {
    return state == State::unknown ? "an undefined state" : quoted(to_string(state));
}

std::string after(Step step) {
    return step == Step::wait ? "" : " after " + quoted(to_string(step));
}

std::string error_words(std::uint16_t code) {
    if (code == 0) return "";
    return print(", error 0x%04X: ", code) + error_word(code);
}

/// The number that explains a failure.
enum class Number : std::uint8_t { none, value, time, statusword };

struct CauseRow {
    Number number;
    const char* placeholder;  ///< of the number, in a message formatted in advance
    const char* text;         ///< of a cause without details; nullptr: sentence() composes it
};
// by Cause
constexpr CauseRow cause_rows[] = {
    {Number::statusword, " (statusword {x})", nullptr},  // none
    {Number::time, " for {} s", nullptr},                // stays
    {Number::statusword, " (statusword {x})", nullptr},  // drive_fault
    {Number::statusword, " (statusword {x})", nullptr},  // left
    {Number::none, "", "drive lost: node no longer operational"},                         // lost
    {Number::time, " for {} s", nullptr},                // mode_rejected
    {Number::value, ": {}", "following error above max-following-error"},  // following_error
    {Number::value, ": {}", nullptr},  // step_rejected
    {Number::value, ": {}", "the command is not a number, or too large"},  // bad_command
    {Number::value, ": {}", "a scale is 0 or not a number"},  // bad_factor
    {Number::statusword, " (statusword {x})", nullptr},  // homing_error
    {Number::time, " within {} s", "home position not attained"},  // homing_timeout
    {Number::time, " for {} s", nullptr},  // set_point
    {Number::none, "", "the axis is not enabled"},  // not_enabled
    {Number::none, "", "function write-all does not run"},  // unwritten
    {Number::none, "", "function read-all does not run"},  // unread
    {Number::none, "", "more than 16 set-points queued"},  // set_point_lost
    {Number::value, ": {}", "max-step or max-following-error is negative"},  // bad_limit
};
static_assert(std::size(cause_rows) == causes);

const CauseRow& row_of(Cause cause) noexcept { return cause_rows[static_cast<std::size_t>(cause)]; }

/// Returns a hint derived from the other bits of the statusword.
std::string hint(const Failure& f) {
    if (f.statusword == 0) return "; check that the statusword is received";
    if (f.cause != Cause::stays || f.state == State::unknown) return "";
    if ((f.statusword & status::remote) == 0) {
        return "; remote is 0: the drive is under local control";
    }
    if ((f.statusword & status::voltage_enabled) == 0 && f.request == Request::enable) {
        return "; voltage-enabled is 0: check the supply of the power stage";
    }
    return "";
}

}  // namespace

bool has_power(State state) noexcept {
    return state == State::operation_enabled || state == State::quick_stop_active ||
           state == State::fault_reaction_active;
}

const char* to_string(Request request) noexcept {
    constexpr const char* words[] = {"enable", "run",  "disable", "quick stop",
                                     "reset",  "mode", "home",    "go"};
    return words[static_cast<unsigned>(request)];
}

const char* to_string(Step step) noexcept {
    constexpr const char* words[] = {"wait",
                                     "shutdown",
                                     "switch on",
                                     "enable operation",
                                     "disable operation",
                                     "disable voltage",
                                     "quick stop",
                                     "fault reset"};
    return words[static_cast<unsigned>(step)];
}

std::string sentence(const Failure& f) {
    const std::string asked = std::string(to_string(f.request)) + ": ";
    if (const char* const text = row_of(f.cause).text) return asked + text;
    switch (f.cause) {
    case Cause::none: return "";
    case Cause::stays:
        return asked + (f.state == State::unknown ? "drive shows " : "drive stays in ") +
               state_words(f.state) + after(f.step);
    case Cause::drive_fault:
        return asked + (f.step != Step::wait || f.request == Request::run
                            ? "drive went into fault" + after(f.step)
                            : "drive is in fault");
    case Cause::left:
        return asked + "drive left " + quoted(to_string(f.before)) + " for " +
               state_words(f.state) + " without a command";
    case Cause::mode_rejected:
        return asked + "drive does not accept " + commanded_mode(f.mode) + ", displays " +
               name(f.shown);
    case Cause::step_rejected:
        return asked + (f.step == Step::wait
                            ? "position-cmd steps farther than max-step"
                            : "position-cmd is farther from position-fb than max-step");
    case Cause::homing_error:
        return asked + "drive reports " + quoted(to_string(homing_of(f.statusword)));
    case Cause::set_point:
        return asked + ((f.statusword & status::set_point_acknowledge) == 0
                            ? "drive does not acknowledge the set-point"
                            : "drive does not clear its acknowledge");
    default: return asked + "failed";
    }
}

std::string text(const Failure& f) {
    std::string all = sentence(f);
    const Number number = row_of(f.cause).number;
    if (f.cause == Cause::following_error || f.cause == Cause::step_rejected) {
        return all + print(" (%g, limit %g)", f.value, f.limit);
    }
    if (number == Number::value) return all + print(" (%g)", f.value);
    if (f.cause == Cause::none || number == Number::none) return all;
    if (number == Number::time) {
        const char* const relation = f.cause == Cause::homing_timeout ? "within" : "for";
        all += print(" %s %.2f s", relation, seconds(f.after));
    }
    return all + print(" (statusword 0x%04X", f.statusword) + error_words(f.error_code) + ")" +
           hint(f);
}

namespace {

std::uint8_t known(Mode mode) noexcept {
    return static_cast<std::uint8_t>(mode == Mode::none || *abbreviation(mode) != '-' ? mode
                                                                                      : any_other);
}

/// Returns everything that selects the message as one number.
std::uint32_t key_of(const Failure& f) noexcept {
    unsigned a = 0;
    unsigned b = 0;
    switch (f.cause) {
    case Cause::stays:
        a = static_cast<unsigned>(f.step);
        b = static_cast<unsigned>(f.state);
        break;
    case Cause::drive_fault:
        a = static_cast<unsigned>(f.step);
        b = f.error_code != 0;
        break;
    case Cause::left:
        a = static_cast<unsigned>(f.before);
        b = static_cast<unsigned>(f.state);
        break;
    case Cause::mode_rejected:
        a = known(f.mode);
        b = known(f.shown);
        break;
    case Cause::homing_error: a = static_cast<unsigned>(homing_of(f.statusword)); break;
    case Cause::set_point: a = f.statusword >> 12 & 1; break;
    case Cause::step_rejected: a = f.step != Step::wait; break;
    default: break;
    }
    return static_cast<std::uint32_t>(f.cause) << 24 | static_cast<std::uint32_t>(f.request) << 16 |
           a << 8 | b;
}

/// Returns what the axis does about a failure.
const char* reaction(const Failure& f) {
    const bool off = f.request == Request::disable || f.request == Request::quick_stop;
    if (f.cause == Cause::lost) return "; it may not receive the command to stop";
    if (f.cause == Cause::stays && off && has_power(f.state)) return "; it still has power";
    return f.request == Request::run ? "; axis stopped" : "; axis off";
}

/// Returns the message with a placeholder for its number and with the reaction of the axis.
std::string reason(const Failure& f) {
    const bool has_error_code = f.cause == Cause::drive_fault && f.error_code != 0;
    const char* const number = has_error_code ? " (error code {x})" : row_of(f.cause).placeholder;
    return sentence(f) + number + reaction(f);
}

}  // namespace

Sentences::Sentences() {
    std::vector<Failure> all;
    const auto add = [&](Cause cause, Request request) -> Failure& {
        Failure f;
        f.cause = cause;
        f.request = request;
        return all.emplace_back(f);
    };
    constexpr unsigned states_and_none = static_cast<unsigned>(State::unknown) + 1;

    constexpr unsigned steps = static_cast<unsigned>(Step::fault_reset) + 1;
    for (unsigned r = 0; r <= static_cast<unsigned>(Request::go); ++r) {
        const auto request = static_cast<Request>(r);
        for (const Cause cause :
             {Cause::lost, Cause::following_error, Cause::bad_command, Cause::bad_factor,
              Cause::homing_timeout, Cause::not_enabled, Cause::unwritten, Cause::unread,
              Cause::set_point_lost, Cause::bad_limit}) {
            add(cause, request);
        }
        for (unsigned step = 0; step < steps; ++step) {
            for (const std::uint16_t code : {std::uint16_t{0}, std::uint16_t{1}}) {
                Failure& f = add(Cause::drive_fault, request);
                f.step = static_cast<Step>(step);
                f.error_code = code;
            }
            for (unsigned state = 0; state < states_and_none; ++state) {
                Failure& f = add(Cause::stays, request);
                f.step = static_cast<Step>(step);
                f.state = static_cast<State>(state);
            }
        }
    }
    for (const Step step : {Step::wait, Step::enable_operation}) {
        add(Cause::step_rejected, step == Step::wait ? Request::run : Request::enable).step = step;
    }
    for (unsigned state = 0; state < states_and_none; ++state) {
        Failure& f = add(Cause::left, Request::run);
        f.before = State::operation_enabled;
        f.state = static_cast<State>(state);
    }
    std::vector<Mode> all_modes{any_other, Mode::none};
    for (const ModeRow& row : modes) {
        all_modes.push_back(row.mode);
    }
    for (const Mode asked : all_modes) {
        for (const Mode shown : all_modes) {
            Failure& f = add(Cause::mode_rejected, Request::mode);
            f.mode = asked;
            f.shown = shown;
        }
    }
    for (unsigned bits = 0; bits < 2; ++bits) {
        add(Cause::set_point, Request::go).statusword =
            bits != 0 ? status::set_point_acknowledge : std::uint16_t{0};
        add(Cause::homing_error, Request::home).statusword = static_cast<std::uint16_t>(
            status::homing_error | (bits != 0 ? status::target_reached : 0));
    }
    std::sort(all.begin(), all.end(),
              [](const Failure& x, const Failure& y) { return key_of(x) < key_of(y); });
    for (const Failure& f : all) {
        keys_.push_back(key_of(f));
        texts_.push_back(reason(f));
    }
}

const char* Sentences::find(const Failure& f) const noexcept {
    const auto at = std::lower_bound(keys_.begin(), keys_.end(), key_of(f));
    return at != keys_.end() && *at == key_of(f)
               ? texts_[static_cast<std::size_t>(at - keys_.begin())].c_str()
               : "the axis failed";
}

double Sentences::number(const Failure& f) noexcept {
    if (f.cause == Cause::drive_fault && f.error_code != 0) return f.error_code;
    switch (row_of(f.cause).number) {
    case Number::none: break;
    case Number::value: return f.value;
    case Number::time: return seconds(f.after);
    case Number::statusword: return f.statusword;
    }
    return std::numeric_limits<double>::quiet_NaN();
}

}  // namespace hal::cia402
