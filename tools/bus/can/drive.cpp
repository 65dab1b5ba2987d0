// SPDX-License-Identifier: MIT
// `hal can drive`: controls a CiA 402 drive by SDO, one command or an interactive session.
#include "bus/can/drive.hpp"

#include <algorithm>
#include <cmath>
#include <fmt/core.h>
#include <unistd.h>

#include "base/types.hpp"
#include "bus/can/drive_shell.hpp"
#include "cli/output.hpp"
#include "text/diagnostic.hpp"

namespace hal::tools {

using namespace canopen::cia402;

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

const char* arguments_of(const std::string& verb) {
    const auto* row = std::find_if(std::begin(verbs), std::end(verbs),
                                   [&](const Verb& v) { return verb == v.name; });
    return row == std::end(verbs) ? "" : row->arguments;
}

}  // namespace

DriveShell::DriveShell(const Options& options, NodeClient& station, Supervision& supervision,
                       const Settings& settings)
    : options_(options), station_(station), supervision_(supervision), settings_(settings) {}

bool DriveShell::print_line(const std::string& text) const { return print(text + "\n"); }
bool DriveShell::wrong(const std::string& sentence) const {
    fail(options_, sentence);
    return false;
}

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

bool DriveShell::without_effect(const std::string& command) const {
    return wrong(
        fmt::format("{0}: a factor is valid for the commands after it, and there are none; type "
                    "them as lines of a session: "
                    "printf '{0}\\nGA:100\\n' | hal can drive {1} --node {2}",
                    command, options_.words.front(), settings_.node));
}

int DriveShell::execute(std::string_view line) {
    line = line.substr(0, line.find('#'));
    pressed_.store(false);
    bool good = true;
    if (const auto done = robot_line(line)) {
        good = *done;
    } else {
        Words words;
        for (std::size_t at = 0; at < line.size();) {
            const std::size_t end = std::min(line.find_first_of(" \t\r\n:", at), line.size());
            if (end > at) {
                words.emplace_back(line.substr(at, end - at));
            }
            at = end + 1;
        }
        if (words.empty()) return 0;
        good = run(std::move(words));
    }
    if (supervision_.collided() && !over_) {
        good =
            wrong(fmt::format("another device sends heartbeats as node {}, so the drive would not "
                              "notice the end of this program; "
                              "start again with another --heartbeat-id",
                              supervision_.own_node()));
        over_ = true;
    }
    over_ = over_ || (!good && settings_.ends_at_failure);
    pressed_.store(false);
    return good ? 0 : 1;
}

std::function<void()> DriveShell::meanwhile() {
    return [this] {
        station_.turn(0);
        // no command is running that it could interrupt
        if (pressed_.load() || supervision_.collided()) {
            station_.bus.stop.request();
        }
    };
}

SdoAxis::Interruption DriveShell::interruption() const {
    using enum SdoAxis::Interruption;
    if (station_.bus.stop.requested() || supervision_.collided()) return end;
    if (pressed_.load()) return stop;
    return none;
}

SdoAxis& DriveShell::axis(unsigned number) {
    auto& made = axes_[number];
    if (!made) {
        made = std::make_unique<SdoAxis>(options_, station_, settings_.node, number);
    }
    made->interrupted = [this] { return interruption(); };
    return *made;
}

bool DriveShell::watched(SdoAxis& a) { return a.look() && supervision_.arm(a.number()); }

int DriveShell::end(bool leave, const char* why, bool expected) {
    bool all = true;
    for (auto& a : axes_) {
        if (!a || !a->touched()) continue;
        if (leave) {
            if (supervision_.active() && a->moves()) {
                write_all(STDERR_FILENO,
                          fmt::format("{0}: {1}: still moving, no longer supervised; to stop it: "
                                      "hal can drive {2} --node {3} "
                                      "{1} stop\n",
                                      options_.program, a->letter(), options_.words.front(),
                                      settings_.node));
            }
            continue;
        }
        std::string what;
        const bool done = a->secure(what);
        all = all && done;
        if (what.empty()) continue;
        if (done && expected) {
            print(fmt::format("{}: {} ({})\n", a->letter(), what, why));
        } else {
            fail(options_, fmt::format("{}: {}{} ({})", a->letter(), what,
                                       !done && supervision_.active()
                                           ? "; the drive stops when it misses our heartbeat"
                                           : "",
                                       why));
        }
    }
    // An axis that could not be stopped stays supervised: the heartbeat ends with this program, and
    // the drive reacts.
    return all && supervision_.release() ? 0 : 1;
}

bool DriveShell::run(Words words) {
    unsigned number = settings_.axis;
    if (words[0].size() == 1) {
        const char letter = static_cast<char>(words[0][0] & ~0x20);
        if (letter < 'A' || letter > 'H') {
            return wrong(fmt::format("invalid axis '{}'; write A to H", words[0]));
        }
        number = static_cast<unsigned>(letter - 'A');
        if (settings_.one_shot && settings_.axis_given) {
            return wrong(fmt::format(
                "--axis has no effect on a command with a letter; delete --axis or '{}'",
                words[0]));
        }
        words.erase(words.begin());
        if (words.empty()) {
            return wrong(fmt::format("missing command for axis {}; type: help", letter));
        }
    }
    const std::string verb = words[0];
    words.erase(words.begin());
    if (verb == "quit" || verb == "exit") {
        if (settings_.one_shot) {
            return wrong(fmt::format(
                "{} ends a session, and there is none; type: hal can drive {} --node {}", verb,
                options_.words.front(), settings_.node));
        }
        return left_ = over_ = true;
    }
    if (verb == "help") return print(help_text());
    SdoAxis& a = axis(number);
    if (verb.ends_with('?')) return query(a, verb.substr(0, verb.size() - 1));
    const auto* row = std::find_if(std::begin(verbs), std::end(verbs),
                                   [&](const Verb& v) { return verb == v.name; });
    if (row == std::end(verbs)) {
        Words names;
        for (const Verb& v : verbs) {
            names.emplace_back(v.name);
        }
        const std::string hint = did_you_mean(verb, names);
        return wrong(
            fmt::format("unknown command '{}'; {}", verb, hint.empty() ? "type: help" : hint));
    }
    return command(a, verb, std::move(words));
}

/// Removes `within TIME` from the arguments; nothing when its time is missing or wrong.
std::optional<std::int64_t> DriveShell::take_within(Words& arguments) const {
    const auto at = std::find(arguments.begin(), arguments.end(), "within");
    if (at == arguments.end()) return settings_.within_ns;
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
        return a.set_mode(mode) && print_line(fmt::format("{}: mode {}", a.letter(), wanted));
    }
    for (const ModeRow& m : modes) {
        if (wanted != m.abbreviation) continue;
        if (m.mode == Mode::homing) {
            return wrong(fmt::format("homing is a command: {} home", a.letter()));
        }
        return wrong(
            fmt::format("mode {} needs a set-point every cycle; use component cia402 in a netlist",
                        m.abbreviation));
    }
    return wrong(fmt::format("invalid mode '{}'; write pp, pv, tq or vl", wanted));
}

/// A command without arguments.
bool DriveShell::simple(SdoAxis& a, const std::string& verb) {
    const char letter = a.letter();
    const bool needs_watch = verb == "on" || verb == "reset";
    if (needs_watch && !watched(a)) return false;
    if (verb == "on") {
        return a.on() && print_line(fmt::format("{}: on", letter));
    }
    if (verb == "off") {
        return a.off() && print_line(fmt::format("{}: off", letter));
    }
    if (verb == "stop") {
        return a.stop() && print_line(fmt::format("{}: stopped at {:.10g}", letter, a.position()));
    }
    if (verb == "quickstop") {
        return a.quick_stop() &&
               print_line(fmt::format("{}: stopped and off, at {:.10g}", letter, a.position()));
    }
    if (verb == "reset") {
        return a.reset() && print_line(fmt::format("{}: no fault", letter));
    }
    if (verb == "wait") {
        return a.wait() && print_line(fmt::format("{}: at {:.10g}", letter, a.position()));
    }
    return status(a);
}

bool DriveShell::command(SdoAxis& a, const std::string& verb, Words arguments) {
    const std::string rest = arguments_of(verb);
    const std::string usage =
        fmt::format("type: {} {}{}{}", a.letter(), verb, rest.empty() ? "" : " ", rest);
    const auto within = take_within(arguments);
    if (!within) {
        return wrong(fmt::format("{}: missing time after within; type: {} {} within 30s", verb,
                                 a.letter(), verb));
    }
    const bool moving = verb == "go" || verb == "speed" || verb == "torque" || verb == "home";
    const std::int64_t by_default = moving || verb == "wait" ? motion_ns : step_ns;
    a.allow(*within > 0 ? *within : by_default);
    if (moving) return motion(a, verb, std::move(arguments), usage);
    if (verb == "mode") {
        return arguments.size() == 1 ? set_mode(a, arguments[0]) : wrong(usage);
    }
    if (verb == "set") {
        if (arguments.size() == 2) return set(a, arguments[0], arguments[1]);
        if (arguments.size() != 1 || !arguments[0].ends_with('?')) return wrong(usage);
        return query(a, arguments[0].substr(0, arguments[0].size() - 1));
    }
    if (!arguments.empty()) {
        return wrong(
            fmt::format("unexpected argument '{}'; type: {} {}", arguments[0], a.letter(), verb));
    }
    return simple(a, verb);
}

bool DriveShell::motion(SdoAxis& a, const std::string& verb, Words arguments,
                        const std::string& usage) {
    const auto flag = [&](const char* name) {
        const auto found = std::find(arguments.begin(), arguments.end(), name);
        if (found == arguments.end()) return false;
        arguments.erase(found);
        return true;
    };
    const char letter = a.letter();
    double value = 0;
    if (verb == "home") {
        if (arguments.size() > 1) return wrong(usage);
        std::optional<int> method;
        if (!arguments.empty()) {
            if (!parse_real(arguments[0], value) || value != std::floor(value) || value < -128 ||
                value > 127) {
                return wrong(
                    fmt::format("invalid homing method '{}'; write 1..37, or a negative one of the "
                                "drive's manual",
                                arguments[0]));
            }
            method = static_cast<int>(value);
        }
        return watched(a) && a.home(method) &&
               print_line(fmt::format("{}: homed, at {:.10g}", letter, a.position()));
    }
    const bool relative = verb == "go" && flag("relative");
    const bool nowait = flag("nowait");
    if (arguments.size() != 1) return wrong(usage);
    if (!parse_real(arguments[0], value)) {
        return wrong(fmt::format("invalid number '{}'; type: {} {} {}", arguments[0], letter, verb,
                                 arguments_of(verb)));
    }
    if (!watched(a)) return false;
    if (verb == "go") {
        if (!a.go(value, relative, !nowait)) return false;
        return print_line(nowait ? fmt::format("{}: moving", letter)
                                 : fmt::format("{}: at {:.10g}", letter, a.position()));
    }
    if (verb == "speed") {
        return a.speed(value, !nowait) &&
               print_line(fmt::format("{}: speed {:.10g}", letter, value));
    }
    return a.torque(value, !nowait) && print_line(fmt::format("{}: torque {:.10g}", letter, value));
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
    const bool value = line.find(" set ") < begin || line.starts_with("set ");
    if (!value) {
        for (const Verb& v : verbs) {
            offer(v.name, v.what);
        }
    }
    for (const std::string& name : value_names(!value)) {
        offer(name + (value ? "" : "?"), "");
    }
    return completion;
}

namespace {

bool duration_of(const Options& options, const std::string& text, std::int64_t& to) {
    const auto ns = parse_duration_ns(text);
    if (!ns || *ns <= 0) {
        fail(options, fmt::format("invalid duration '{}'; use 200ms or 1s", text));
        return false;
    }
    to = *ns;
    return true;
}

/// Takes the options out of the words: they may be before or after the address. The rest is the
/// command.
bool take_options(DriveOptions& options) {
    std::vector<std::string> rest;
    std::string timeout;
    for (std::size_t i = 0; i < options.words.size(); ++i) {
        const std::string& w = options.words[i];
        std::string* const to = w == "--node"           ? &options.node
                                : w == "--axis"         ? &options.axis
                                : w == "--timeout"      ? &timeout
                                : w == "--within"       ? &options.within
                                : w == "--supervise"    ? &options.supervise
                                : w == "--heartbeat-id" ? &options.heartbeat_id
                                                        : nullptr;
        if (w == "-k" || w == "--keep-going") {
            options.keep_going = true;
        } else if (to && i + 1 == options.words.size()) {
            fail(options, fmt::format("missing value of {}", w));
            return false;
        } else if (to) {
            *to = options.words[++i];
        } else if (w.starts_with("--")) {
            fail(options, fmt::format("unknown option '{}'; see: hal help can drive", w));

            return false;
        } else {
            rest.push_back(w);
        }
    }
    options.words = std::move(rest);
    return timeout.empty() || duration_of(options, timeout, options.timeout_ns);
}

bool supervision_of(const DriveOptions& options, SupervisionSettings& settings) {
    if (!options.heartbeat_id.empty() &&
        !node_of(options, options.heartbeat_id, settings.own_node)) {
        return false;
    }
    if (options.supervise.empty()) return true;
    if (options.supervise == "off") {
        settings.limit_ns = 0;
        return true;
    }
    const auto ns = parse_duration_ns(options.supervise);
    if (!ns || *ns < 50'000'000 || *ns > 65'000'000'000) {
        fail(options,
             fmt::format("invalid --supervise '{}'; write 50ms to 65s, or off", options.supervise));

        return false;
    }
    settings.limit_ns = *ns;
    return true;
}

}  // namespace

int run_can_drive(const DriveOptions& given) {
    DriveOptions options = given;
    if (!take_options(options)) return 1;
    if (options.words.empty()) {
        return fail(options, "missing address; type: hal can drive can:can0 --node 2 A on");
    }
    if (options.node.empty()) {
        return fail(options, fmt::format("missing --node; type: hal can drive {} --node 2",
                                         options.words[0]));
    }
    std::uint8_t node = 0;
    if (!node_of(options, options.node, node)) return 1;
    const std::string& letter = options.axis;
    const char axis = letter.empty() ? 'A' : static_cast<char>(letter[0] & ~0x20);
    if (letter.size() > 1 || axis < 'A' || axis > 'H') {
        return fail(options, fmt::format("invalid axis '{}'; write A to H", letter));
    }

    SupervisionSettings watched;
    std::int64_t within = 0;
    if (!supervision_of(options, watched) ||
        (!options.within.empty() && !duration_of(options, options.within, within))) {
        return 1;
    }

    NodeClient station(options, options.timeout_ns);
    const bool one_shot = options.words.size() > 1;
    const bool terminal = ::isatty(STDIN_FILENO) == 1;
    if (one_shot && options.keep_going) {
        return fail(options,
                    "--keep-going is for commands from a file or pipe; delete it, or the command");
    }
    if (options.supervise == "off" && !options.heartbeat_id.empty()) {
        return fail(options,
                    "--heartbeat-id has no effect with --supervise off; delete one of them");
    }
    Supervision supervision(options, station, node, watched);
    DriveShell shell(options, station, supervision,
                     {.node = node,
                      .axis = static_cast<unsigned>(axis - 'A'),
                      .ends_at_failure = !terminal && !options.keep_going,
                      .prompt = !one_shot && terminal,
                      .one_shot = one_shot,
                      .axis_given = !letter.empty(),
                      .within_ns = within});
    station.bus.stop.when_signalled([&shell] { shell.press(); });
    // at a prompt Ctrl-C ends a command, not the session
    station.bus.stop.spare(terminal && !one_shot);
    station.outlasts_stop = true;  // axes are stopped before the session ends
    if (!station.open(options.words[0])) return 1;
    int status = 1;
    try {
        if (one_shot) {
            std::string line;
            for (std::size_t i = 1; i < options.words.size(); ++i) {
                line += options.words[i] + " ";
            }
            status = shell.execute(line);
        } else {
            if (terminal) {
                print(fmt::format("node {} on {}; type 'help' for the commands, Tab completes\n",
                                  node, options.words[0]));
            }
            status = run_prompt_loop(shell, {"drive> ", "drive> "}, station.bus.stop.fd());
        }
    } catch (...) {
        shell.end(false, "internal error", false);
        throw;
    }
    const bool ended = station.bus.stop.requested();
    const bool leave = !ended && (shell.left() || (one_shot && status == 0));

    const bool failed = one_shot || shell.over();
    const char* const why = ended ? "interrupted" : failed ? "after the failure" : "end of input";
    return std::max({status, shell.end(leave, why, !ended && !failed), ended ? 1 : 0});
}

}  // namespace hal::tools
