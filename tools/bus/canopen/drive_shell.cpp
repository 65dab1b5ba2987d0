// SPDX-License-Identifier: MIT
#include "bus/canopen/drive_shell.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <string_view>

#include "base/types.hpp"
#include "cli/output.hpp"
#include "text/diagnostic.hpp"
#include "text/find_row.hpp"

namespace hal::tools {

using namespace cia402;

struct DriveShell::Motion {
    double value = 0;
    bool relative = false;
    bool wait = true;
};

namespace {

// for a command, when no time is given
constexpr std::int64_t step_ns = 15'000'000'000;
constexpr std::int64_t motion_ns = 60'000'000'000;

struct Verb {
    const char *name, *arguments, *what;
};
constexpr Verb verbs[] = {
    {"on", "", "enable the axis (operation enabled)"},
    {"off", "", "brake and disable the axis"},
    {"go", "POSITION [relative] [nowait]", "move to a position (pp); ends on arrival"},
    {"speed", "SPEED [nowait]", "move at a speed (pv; in mode vl: r/min)"},
    {"torque", "PERMILLE [nowait]", "apply a torque in thousandths of the rated torque (tq)"},
    {"stop", "", "brake to standstill and stay enabled"},
    {"quickstop", "", "brake with quick stop and disable the axis"},
    {"home", "[METHOD]", "home the axis; METHOD of CiA 402, 1..37"},
    {"reset", "", "reset a fault"},
    {"mode", "pp|pv|tq|vl", "mode of operation"},
    {"wait", "", "wait until the target is reached"},
    {"status", "", "print state, mode, position, speed, torque, error"},
    {"set", "NAME VALUE", "set a parameter of the drive, or a factor: position-factor 4096/360"},
    {"help", "", "print this list"},
    {"quit", "", "end the session and leave the axes as they are: enabled, or moving"},
};

/// A command without arguments that acts on the axis, and what is printed after it.
struct SimpleVerb {
    std::string_view name;
    bool (SdoAxis::*run)();
    const char* report;
    bool has_position;  ///< the report ends with it
    bool needs_watch;   ///< the node must be supervised
};
constexpr SimpleVerb simple_verbs[] = {
    {"on", &SdoAxis::on, "on", false, true},
    {"off", &SdoAxis::off, "off", false, false},
    {"stop", &SdoAxis::stop, "stopped at", true, false},
    {"quickstop", &SdoAxis::quick_stop, "stopped and off, at", true, false},
    {"reset", &SdoAxis::reset, "no fault", false, true},
    {"wait", &SdoAxis::wait, "at", true, false},
};

const Verb* find_verb(const std::string& name) { return find_row(verbs, name, &Verb::name); }

std::string usage_of(const SdoAxis& a, const Verb& verb) {
    const std::string text = fmt::format("type: {} {}", a.letter(), verb.name);
    return *verb.arguments ? fmt::format("{} {}", text, verb.arguments) : text;
}

std::vector<std::string> words_of(std::string_view line) {
    std::vector<std::string> words;
    for (std::size_t at = 0; at < line.size();) {
        const std::size_t end = std::min(line.find_first_of(" \t\r\n:", at), line.size());
        if (end > at) {
            words.emplace_back(line.substr(at, end - at));
        }
        at = end + 1;
    }
    return words;
}

/// Removes a flag from the arguments. Returns true when it was among them.
bool pop_flag(std::vector<std::string>& arguments, const char* name) {
    const auto found = std::find(arguments.begin(), arguments.end(), name);
    if (found == arguments.end()) return false;
    arguments.erase(found);
    return true;
}

bool parse_homing_method(const std::string& text, int& method) {
    double value = 0;
    if (!parse_real(text, value) || value != std::floor(value)) return false;
    if (value < -128 || value > 127) return false;
    method = static_cast<int>(value);
    return true;
}

}  // namespace

std::string DriveShell::help_text() {
    std::string text = "  write the letter of the axis before a command: A on\n";
    for (const Verb& v : verbs) {
        text += fmt::format("  {:38} {}\n", std::string(v.name) + " " + v.arguments, v.what);
    }
    text +=
        "  COMMAND within TIME: the command fails after TIME, and a motion is stopped (default "
        "60s; on, off, stop ... 15s)\n";
    text +=
        "  parameters: set NAME VALUE writes, NAME? reads; position?, speed?, torque?, mode? and "
        "state? are read-only\n";
    return text + value_help() +
           "  HELP lists the robot-shell commands, which end with the axis: ONA: GA:1000 APA?\n";
}

int DriveShell::execute(std::string_view line) {
    line = line.substr(0, line.find('#'));
    session_.clear_press();
    std::optional<bool> done = robot_.execute(line);
    if (!done) {
        Words words = words_of(line);
        if (words.empty()) return 0;
        done = run(std::move(words));
    }
    bool good = *done;
    if (!over_ && session_.collided()) {
        good = false;
        over_ = true;
    }
    over_ = over_ || (!good && session_.settings().ends_at_failure);
    session_.clear_press();
    return exit_code(good);
}

std::function<void()> DriveShell::meanwhile() {
    return [this] { session_.idle(); };
}

/// Removes the letter of an axis from the words. Returns nullopt after printing the reason.
std::optional<unsigned> DriveShell::parse_axis(Words& words) const {
    if (words[0].size() != 1) return session_.settings().axis;
    const char letter = static_cast<char>(words[0][0] & ~0x20);
    if (letter < 'A' || letter > 'H') {
        session_.wrong(fmt::format("invalid axis '{}'; write A to H", words[0]));
        return std::nullopt;
    }
    if (session_.settings().one_shot && session_.settings().axis_given) {
        session_.wrong(fmt::format(
            "--axis has no effect on a command with a letter; delete --axis or '{}'", words[0]));
        return std::nullopt;
    }
    words.erase(words.begin());
    if (words.empty()) {
        session_.wrong(fmt::format("missing command for axis {}; type: help", letter));
        return std::nullopt;
    }
    return static_cast<unsigned>(letter - 'A');
}

bool DriveShell::quit(const std::string& verb) {
    if (session_.settings().one_shot) {
        return session_.wrong(
            fmt::format("{} works in a session only; to open one type: hal can drive {} --node {}",
                        verb, session_.options().words.front(), session_.settings().node));
    }
    over_ = true;
    left_ = true;
    return true;
}

bool DriveShell::run(Words words) {
    const std::optional<unsigned> number = parse_axis(words);
    if (!number) return false;
    const std::string verb = words[0];
    words.erase(words.begin());
    if (verb == "quit" || verb == "exit") return quit(verb);
    if (verb == "help") return print(help_text());
    SdoAxis& a = session_.axis(*number);
    if (verb.ends_with('?')) return values_.query(a, verb.substr(0, verb.size() - 1));
    if (find_verb(verb)) return command(a, verb, std::move(words));
    Words names;
    for (const Verb& v : verbs) {
        names.emplace_back(v.name);
    }
    const std::string hint = did_you_mean(verb, names);
    return session_.wrong(
        fmt::format("unknown command '{}'; {}", verb, hint.empty() ? "type: help" : hint));
}

/// Removes `within TIME` from the arguments; nothing when its time is missing or wrong.
std::optional<std::int64_t> DriveShell::parse_within(Words& arguments) const {
    const auto at = std::find(arguments.begin(), arguments.end(), "within");
    if (at == arguments.end()) return session_.settings().within_ns;
    const auto ns = at + 1 == arguments.end() ? std::nullopt : parse_duration_ns(at[1]);
    if (!ns || *ns <= 0) return std::nullopt;
    arguments.erase(at, at + 2);
    return ns;
}

bool DriveShell::set_mode(SdoAxis& a, const std::string& wanted) {
    constexpr Mode by_hand[] = {Mode::profile_position, Mode::profile_velocity,
                                Mode::profile_torque, Mode::velocity};
    for (const Mode mode : by_hand) {
        if (wanted != abbreviation(mode)) continue;
        return a.set_mode(mode) &&
               session_.print_line(fmt::format("{}: mode {}", a.letter(), wanted));
    }
    for (const ModeRow& m : modes) {
        if (wanted != m.abbreviation) continue;
        if (m.mode == Mode::homing) {
            return session_.wrong(fmt::format("homing is a command: {} home", a.letter()));
        }
        return session_.wrong(
            fmt::format("mode {} needs a set-point every cycle; use component cia402 in a netlist",
                        m.abbreviation));
    }
    return session_.wrong(fmt::format("invalid mode '{}'; write pp, pv, tq or vl", wanted));
}

/// A command without arguments.
bool DriveShell::simple(SdoAxis& a, const std::string& verb) {
    const SimpleVerb* const row = find_row(simple_verbs, verb, &SimpleVerb::name);
    if (!row) return values_.status(a);
    if (row->needs_watch && !session_.watched(a)) return false;
    if (!(a.*row->run)()) return false;
    const std::string at = row->has_position ? fmt::format(" {:.10g}", a.position()) : "";
    return session_.print_line(fmt::format("{}: {}{}", a.letter(), row->report, at));
}

bool DriveShell::command(SdoAxis& a, const std::string& verb, Words arguments) {
    const std::string usage = usage_of(a, *find_verb(verb));
    const auto within = parse_within(arguments);
    if (!within) {
        return session_.wrong(
            fmt::format("{0}: missing time after within; type: {1} {0} within "
                        "30s",
                        verb, a.letter()));
    }
    const bool moving = verb == "go" || verb == "speed" || verb == "torque" || verb == "home";
    const std::int64_t by_default = moving || verb == "wait" ? motion_ns : step_ns;
    a.allow(*within > 0 ? *within : by_default);
    if (verb == "home") return home(a, arguments, usage);
    if (moving) return motion(a, verb, std::move(arguments), usage);
    if (verb == "mode") {
        return arguments.size() == 1 ? set_mode(a, arguments[0]) : session_.wrong(usage);
    }
    if (verb == "set") {
        if (arguments.size() == 2) return values_.set(a, arguments[0], arguments[1]);
        if (arguments.size() != 1 || !arguments[0].ends_with('?')) return session_.wrong(usage);
        return values_.query(a, arguments[0].substr(0, arguments[0].size() - 1));
    }
    if (!arguments.empty()) {
        return session_.wrong(
            fmt::format("unexpected argument '{}'; type: {} {}", arguments[0], a.letter(), verb));
    }
    return simple(a, verb);
}

bool DriveShell::home(SdoAxis& a, const Words& arguments, const std::string& usage) {
    if (arguments.size() > 1) return session_.wrong(usage);
    std::optional<int> method;
    if (!arguments.empty() && !parse_homing_method(arguments[0], method.emplace())) {
        return session_.wrong(
            fmt::format("invalid homing method '{}'; write 1..37, or a negative one of the "
                        "drive's manual",
                        arguments[0]));
    }
    return session_.watched(a) && a.home(method) &&
           session_.print_line(fmt::format("{}: homed, at {:.10g}", a.letter(), a.position()));
}

bool DriveShell::motion(SdoAxis& a, const std::string& verb, Words arguments,
                        const std::string& usage) {
    Motion motion;
    motion.relative = verb == "go" && pop_flag(arguments, "relative");
    motion.wait = !pop_flag(arguments, "nowait");
    if (arguments.size() != 1) return session_.wrong(usage);
    if (!parse_real(arguments[0], motion.value)) {
        return session_.wrong(fmt::format("invalid number '{}'; {}", arguments[0], usage));
    }
    return session_.watched(a) && move(a, verb, motion);
}

bool DriveShell::move(SdoAxis& a, const std::string& verb, const Motion& motion) {
    const double value = motion.value;
    if (verb == "speed") {
        return a.speed(value, motion.wait) &&
               session_.print_line(fmt::format("{}: speed {:.10g}", a.letter(), value));
    }
    if (verb == "torque") {
        return a.torque(value, motion.wait) &&
               session_.print_line(fmt::format("{}: torque {:.10g}", a.letter(), value));
    }
    if (!a.go(value, motion.relative, motion.wait)) return false;
    if (!motion.wait) return session_.print_line(fmt::format("{}: moving", a.letter()));
    return session_.print_line(fmt::format("{}: at {:.10g}", a.letter(), a.position()));
}

Completion DriveShell::complete(std::string_view line, std::size_t cursor) {
    Completion completion;
    const std::size_t begin = line.substr(0, cursor).find_last_of(" ") + 1;
    completion.begin = begin;
    const std::string_view typed = line.substr(begin, cursor - begin);
    const auto offer = [&](std::string text, const char* hint) {
        if (text.starts_with(typed)) {
            completion.candidates.push_back({std::move(text), hint});
        }
    };
    const bool is_set = line.find(" set ") < begin || line.starts_with("set ");
    if (is_set) {
        for (const std::string& name : value_names(false)) {
            offer(name, "");
        }
        return completion;
    }
    for (const Verb& v : verbs) {
        offer(v.name, v.what);
    }
    for (const std::string& name : value_names(true)) {
        offer(name + "?", "");  // to read it
    }
    return completion;
}

}  // namespace hal::tools
