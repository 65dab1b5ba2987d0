// SPDX-License-Identifier: MIT
// `hal can drive`: a drive of CiA 402 by hand, one command or a shell of them.
#include <algorithm>
#include <array>
#include <atomic>
#include <charconv>
#include <cmath>
#include <fmt/core.h>
#include <memory>
#include <unistd.h>

#include "base/diagnostic.hpp"
#include "base/types.hpp"
#include "can/drive_axis.hpp"
#include "say.hpp"
#include "talk.hpp"

namespace hal::tools {

using namespace canopen::cia402;

namespace {

using Words = std::vector<std::string>;

/// Values that `set` writes and `NAME?` reads. In units of the user where `unit` says which.
struct Setting {
    enum class Unit { none, position, velocity, acceleration };
    const char* name;
    std::uint16_t index;
    std::uint8_t sub;
    unsigned bytes;
    bool is_signed;
    Unit unit;
    const char* what;
};
using enum Setting::Unit;
constexpr Setting settings[] = {
    {"max-speed", object::profile_velocity, 0, 4, false, velocity, "of moves (6081h)"},
    {"max-acceleration", object::profile_acceleration, 0, 4, false, acceleration, "of moves (6083h)"},
    {"max-deceleration", object::profile_deceleration, 0, 4, false, acceleration, "of moves (6084h)"},
    {"jerk", object::profile_jerk, 1, 4, false, acceleration, "of moves with ramps 3, per second (60A4h:1)"},
    {"ramps", object::motion_profile_type, 0, 2, true, none, "of moves: 0 linear, 3 with limited jerk (6086h)"},
    {"quick-stop-deceleration", object::quick_stop_deceleration, 0, 4, false, acceleration, "6085h"},
    {"max-torque", object::max_torque, 0, 2, false, none, "thousandths of the rated one (6072h)"},
    {"following-error-window", object::following_error_window, 0, 4, false, position, "6065h"},
    {"home-offset", object::home_offset, 0, 4, true, position, "position at the home switch (607Ch)"},
    {"home-speed", object::homing_speeds, 1, 4, false, velocity, "to the switch (6099h:1)"},
    {"home-slow-speed", object::homing_speeds, 2, 4, false, velocity, "to the index pulse or edge (6099h:2)"},
    {"home-acceleration", object::homing_acceleration, 0, 4, false, acceleration, "609Ah"},
};
constexpr const char* factors[] = {"position-factor", "velocity-factor", "acceleration-factor"};

struct Verb {
    const char *name, *arguments, *what;
};
constexpr Verb verbs[] = {
    {"on", "", "walk to operation enabled"},
    {"off", "", "brake and switch off"},
    {"go", "POSITION [relative] [nowait]", "move there (pp); ends when it is there"},
    {"speed", "SPEED [nowait]", "turn at that speed (pv; in mode vl: r/min)"},
    {"torque", "PERMILLE [nowait]", "give that torque, in thousandths of the rated one (tq)"},
    {"stop", "", "stand still, and stay on"},
    {"quickstop", "", "brake as fast as the drive may, and switch off"},
    {"home", "[METHOD]", "find the home position; a method of CiA 402, 1 to 37"},
    {"reset", "", "reset a fault"},
    {"mode", "pp|pv|tq|vl", "mode of operation"},
    {"wait", "", "until the target is reached"},
    {"status", "", "state, mode, position, speed, torque, error"},
    {"set", "NAME VALUE", "a value of the drive, or a factor: position-factor 4096/360"},
    {"help", "", "this list"},
    {"quit", "", "end; the axes stay as they are"},
};

bool number(const std::string& text, double& value) {
    const char* first = text.c_str() + (text.starts_with('+') ? 1 : 0);
    const auto [end, error] = std::from_chars(first, text.c_str() + text.size(), value);
    return error == std::errc() && *end == '\0' && std::isfinite(value);
}

/// `4096/360`, `4096,360`, `4096`.
bool parse_factor(const std::string& text, Factor& factor) {
    const auto mark = text.find_first_of("/,");
    Factor read;
    if (!number(text.substr(0, mark), read.numerator)) return false;
    if (mark != text.npos && !number(text.substr(mark + 1), read.denominator)) return false;
    if (!read.sound()) return false;
    return factor = read, true;
}

std::string help_text() {
    std::string text = "  commands stand behind the letter of an axis: A on\n";
    for (const Verb& v : verbs) text += fmt::format("  {:38} {}\n", std::string(v.name) + " " + v.arguments, v.what);
    text += "  values: set NAME VALUE writes, NAME? reads; position?, speed?, torque?, mode? and state? are read only\n";
    for (const Setting& s : settings) text += fmt::format("    {:36} {}\n", s.name, s.what);
    for (const char* name : factors) text += fmt::format("    {:36} drive's units per unit of yours, NUMERATOR/DENOMINATOR\n", name);
    return text;
}

class DriveShell final : public Listener {
public:
    DriveShell(const Options& options, Station& station, std::uint8_t node, unsigned axis, bool ends_at_failure)
        : options_(options), station_(station), node_(node), axis_(axis), ends_at_failure_(ends_at_failure) {}

    int execute(std::string_view line) override {
        Words words;
        for (std::size_t at = 0; at < line.size() && line[at] != '#';) {
            const std::size_t end = std::min(line.find_first_of(" \t\r\n#:", at), line.size());
            if (end > at) words.emplace_back(line.substr(at, end - at));
            at = end < line.size() && line[end] != '#' ? end + 1 : end;
        }
        if (words.empty()) return 0;
        pressed_.store(false);
        const bool good = run(std::move(words));
        over_ = over_ || (!good && ends_at_failure_);
        return good ? 0 : 1;
    }
    Completion complete(std::string_view line, std::size_t cursor) override;
    bool collecting() const override { return false; }
    bool over() const override { return over_ || station_.bus.stop.requested(); }
    void press() { pressed_.store(true); }

private:
    bool run(Words);
    bool say(const HandAxis&, const std::string& text) { return print(text + "\n"); }
    bool wrong(const std::string& sentence) const { return fail(options_, sentence), false; }
    bool command(HandAxis&, const std::string& verb, Words arguments);
    bool query(HandAxis&, const std::string& name);
    bool set(HandAxis&, const std::string& name, const std::string& value);
    bool status(HandAxis&);
    HandAxis& axis(unsigned number) {
        auto& made = axes_[number];
        if (!made) made = std::make_unique<HandAxis>(options_, station_, node_, number);
        made->interrupted = [this] { return pressed_.load() || station_.bus.stop.requested(); };
        return *made;
    }

    const Options& options_;
    Station& station_;
    const std::uint8_t node_;
    const unsigned axis_;
    const bool ends_at_failure_;
    std::array<std::unique_ptr<HandAxis>, most_axes> axes_;
    std::atomic<bool> pressed_{false};
    bool over_ = false;
};

bool DriveShell::run(Words words) {
    unsigned number = axis_;
    if (words[0].size() == 1) {
        const char letter = static_cast<char>(words[0][0] & ~0x20);
        if (letter < 'A' || letter > 'H') return wrong(fmt::format("'{}' is no axis; write A to H", words[0]));
        number = static_cast<unsigned>(letter - 'A');
        words.erase(words.begin());
        if (words.empty()) return wrong(fmt::format("what shall axis {} do? type: help", letter));
    }
    const std::string verb = words[0];
    words.erase(words.begin());
    if (verb == "quit" || verb == "exit") return over_ = true;
    if (verb == "help") return print(help_text());
    HandAxis& a = axis(number);
    if (verb.ends_with('?')) return query(a, verb.substr(0, verb.size() - 1));
    const auto* row = std::find_if(std::begin(verbs), std::end(verbs), [&](const Verb& v) { return verb == v.name; });
    if (row == std::end(verbs)) {
        Words names;
        for (const Verb& v : verbs) names.emplace_back(v.name);
        const std::string hint = did_you_mean(verb, names);
        return wrong(fmt::format("there is no command '{}'; {}", verb, hint.empty() ? "type: help" : hint));
    }
    return command(a, verb, std::move(words));
}

bool DriveShell::command(HandAxis& a, const std::string& verb, Words arguments) {
    const auto* row = std::find_if(std::begin(verbs), std::end(verbs), [&](const Verb& v) { return verb == v.name; });
    const auto usage = [&] {
        return wrong(fmt::format("type: {} {}{}{}", a.letter(), verb, *row->arguments != '\0' ? " " : "", row->arguments));
    };
    const auto flag = [&](const char* name) {
        const auto found = std::find(arguments.begin(), arguments.end(), name);
        if (found == arguments.end()) return false;
        arguments.erase(found);
        return true;
    };
    const char letter = a.letter();
    double value = 0;
    if (verb == "go" || verb == "speed" || verb == "torque") {
        const bool relative = verb == "go" && flag("relative"), nowait = flag("nowait");
        if (arguments.size() != 1) return usage();
        if (!number(arguments[0], value))
            return wrong(fmt::format("'{}' is no number; type: {} {} {}", arguments[0], letter, verb, row->arguments));
        if (verb == "go") {
            if (!a.go(value, relative, !nowait)) return false;
            return say(a, nowait ? fmt::format("{}: moves", letter) : fmt::format("{}: at {:g}", letter, a.position()));
        }
        if (verb == "speed") return a.speed(value, !nowait) && say(a, fmt::format("{}: speed {:g}", letter, value));
        return a.torque(value, !nowait) && say(a, fmt::format("{}: torque {:g}", letter, value));
    }
    if (verb == "home") {
        if (arguments.size() > 1) return usage();
        std::optional<int> method;
        if (!arguments.empty()) {
            if (!number(arguments[0], value) || value != std::floor(value) || value < -128 || value > 127)
                return wrong(fmt::format("'{}' is no homing method; write 1 to 37, or what the drive's manual has below 0", arguments[0]));
            method = static_cast<int>(value);
        }
        return a.home(method) && say(a, fmt::format("{}: homed, at {:g}", letter, a.position()));
    }
    if (verb == "mode") {
        constexpr Mode by_hand[] = {Mode::profile_position, Mode::profile_velocity, Mode::profile_torque, Mode::velocity};
        if (arguments.size() != 1) return usage();
        for (const Mode mode : by_hand)
            if (arguments[0] == abbreviation(mode)) return a.set_mode(mode) && say(a, fmt::format("{}: mode {}", letter, arguments[0]));
        for (const ModeRow& m : modes)
            if (arguments[0] == m.abbreviation)
                return wrong(m.mode == Mode::homing
                                 ? fmt::format("homing is a command: {} home", letter)
                                 : fmt::format("{} wants a set-point every cycle; use component cia402 in a netlist", m.abbreviation));
        return wrong(fmt::format("'{}' is no mode; write pp, pv, tq or vl", arguments[0]));
    }
    if (verb == "set") {
        if (arguments.size() == 1 && arguments[0].ends_with('?')) return query(a, arguments[0].substr(0, arguments[0].size() - 1));
        return arguments.size() == 2 ? set(a, arguments[0], arguments[1]) : usage();
    }
    if (!arguments.empty()) return wrong(fmt::format("nothing is expected at '{}'; type: {} {}", arguments[0], letter, verb));
    if (verb == "on") return a.on() && say(a, fmt::format("{}: on", letter));
    if (verb == "off") return a.off() && say(a, fmt::format("{}: off", letter));
    if (verb == "stop") return a.stop() && say(a, fmt::format("{}: stands at {:g}", letter, a.position()));
    if (verb == "quickstop") return a.quick_stop() && say(a, fmt::format("{}: stopped and off, at {:g}", letter, a.position()));
    if (verb == "reset") return a.reset() && say(a, fmt::format("{}: no fault", letter));
    if (verb == "wait") return a.wait() && say(a, fmt::format("{}: at {:g}", letter, a.position()));
    return status(a);
}

double factor_of(const HandAxis& a, Setting::Unit unit) {
    return unit == position       ? a.rules.position.ratio()
           : unit == velocity     ? std::fabs(a.rules.velocity.ratio())
           : unit == acceleration ? std::fabs(a.rules.acceleration.ratio())
                                  : 1.0;
}

Factor* find_factor(HandAxis& a, const std::string& name) {
    Factor* const all[] = {&a.rules.position, &a.rules.velocity, &a.rules.acceleration};
    const auto* found = std::find(std::begin(factors), std::end(factors), name);
    return found == std::end(factors) ? nullptr : all[found - std::begin(factors)];
}

bool no_such_value(const Options& options, const std::string& name, bool reading) {
    Words names(std::begin(factors), std::end(factors));
    for (const Setting& s : settings) names.emplace_back(s.name);
    if (reading) names.insert(names.end(), {"position", "speed", "torque", "mode", "state"});
    const std::string hint = did_you_mean(name, names);
    return fail(options, fmt::format("there is no value '{}'; {}", name, hint.empty() ? "type: help" : hint)), false;
}

bool DriveShell::query(HandAxis& a, const std::string& name) {
    if (const Factor* f = find_factor(a, name))
        return say(a, fmt::format("{}: {} {:g}/{:g}", a.letter(), name, f->numerator, f->denominator));
    for (const Setting& s : settings) {
        if (name != s.name) continue;
        std::int64_t value = 0;
        if (!a.read(s.index, s.sub, value, s.is_signed)) return false;
        return say(a, fmt::format("{}: {} {:g}", a.letter(), name, static_cast<double>(value) / factor_of(a, s.unit)));
    }
    const bool known = name == "position" || name == "speed" || name == "torque" || name == "mode" || name == "state";
    if (!known) return no_such_value(options_, name, true);
    if (!a.look()) return false;
    const AxisFeedback& seen = a.seen();
    const std::string value = name == "position" ? fmt::format("{:g}", a.position())
                              : name == "speed"  ? fmt::format("{:g}", a.velocity())
                              : name == "torque" ? fmt::format("{:g}", a.rules.torque.to_user(seen.torque))
                              : name == "mode"   ? std::string(abbreviation(seen.mode))
                                                 : std::string(word(state_of(seen.statusword)));
    return say(a, fmt::format("{}: {} {}", a.letter(), name, value));
}

bool DriveShell::set(HandAxis& a, const std::string& name, const std::string& text) {
    if (Factor* f = find_factor(a, name)) {
        if (!parse_factor(text, *f))
            return wrong(fmt::format("'{}' is no factor; write NUMERATOR/DENOMINATOR, such as 4096/360, neither of them 0", text));
        return query(a, name);
    }
    const auto* s = std::find_if(std::begin(settings), std::end(settings), [&](const Setting& each) { return name == each.name; });
    if (s == std::end(settings)) return no_such_value(options_, name, false);
    double value = 0;
    if (!number(text, value)) return wrong(fmt::format("'{}' is no number; type: {} set {} NUMBER", text, a.letter(), name));
    const double raw = std::nearbyint(value * factor_of(a, s->unit));
    const double most = std::ldexp(1.0, static_cast<int>(8 * s->bytes) - (s->is_signed ? 1 : 0)) - 1;
    const double least = s->is_signed ? -most - 1 : 0.0;
    if (raw < least || raw > most)
        return wrong(fmt::format("{} {:g} is {:g} in the drive's units, which go from {:g} to {:g}", name, value, raw, least, most));
    std::int64_t back = 0;
    if (!a.write(s->index, s->sub, static_cast<std::int64_t>(raw), s->bytes)) return false;
    if (!a.read(s->index, s->sub, back, s->is_signed)) return false;
    if (static_cast<double>(back) != raw)
        return a.refuse(fmt::format("drive keeps {} at {:g}", name, static_cast<double>(back) / factor_of(a, s->unit)));
    return say(a, fmt::format("{}: {} {:g}", a.letter(), name, static_cast<double>(back) / factor_of(a, s->unit)));
}

bool DriveShell::status(HandAxis& a) {
    if (!a.look()) return false;
    const AxisFeedback& seen = a.seen();
    const State state = state_of(seen.statusword);
    std::string text =
        fmt::format("{}: {}, mode {}, statusword 0x{:04X}", a.letter(), word(state), abbreviation(seen.mode), seen.statusword);
    constexpr std::pair<std::uint16_t, const char*> bits[] = {
        {status::voltage_enabled, "voltage enabled"}, {status::warning, "warning"}, {status::remote, "remote"},
        {status::target_reached, "target reached"}, {status::internal_limit, "internal limit"}};
    for (const auto& [bit, name] : bits)
        if ((seen.statusword & bit) != 0) text += fmt::format(", {}", name);
    text += fmt::format("\n   position {:g}, speed {:g}, torque {:g}", a.position(), a.velocity(), a.rules.torque.to_user(seen.torque));
    if (state == State::fault && seen.error_code != 0)
        text += fmt::format("\n   error 0x{:04X}: {}", seen.error_code, error_word(seen.error_code));
    return say(a, text);
}

Completion DriveShell::complete(std::string_view line, std::size_t cursor) {
    Completion completion;
    const std::size_t begin = line.substr(0, cursor).find_last_of(" ") + 1;
    completion.begin = begin;
    const std::string_view typed = line.substr(begin, cursor - begin);
    const auto offer = [&](std::string text, const char* hint) {
        if (text.starts_with(typed)) completion.candidates.push_back({std::move(text), hint});
    };
    const bool value = line.find(" set ") < begin || line.starts_with("set ");
    if (!value)
        for (const Verb& v : verbs) offer(v.name, v.what);
    for (const Setting& s : settings) offer(std::string(s.name) + (value ? "" : "?"), s.what);
    for (const char* name : factors) offer(std::string(name) + (value ? "" : "?"), "");
    return completion;
}

/// Takes the options out of the words: they may stand before and behind the address. What is left is the command.
bool take_options(Options& options) {
    Words rest;
    std::string timeout;
    for (std::size_t i = 0; i < options.words.size(); ++i) {
        const std::string& w = options.words[i];
        std::string* const to = w == "--node"      ? &options.drive_node
                                : w == "--axis"    ? &options.drive_axis
                                : w == "--timeout" ? &timeout
                                                   : nullptr;
        if (w == "-k" || w == "--keep-going") options.keep_going = true;
        else if (to && i + 1 == options.words.size()) return fail(options, fmt::format("something is missing behind {}", w)), false;
        else if (to) *to = options.words[++i];
        else if (w.starts_with("--")) return fail(options, fmt::format("there is no option '{}'; see: hal help can drive", w)), false;
        else rest.push_back(w);
    }
    options.words = std::move(rest);
    if (timeout.empty()) return true;
    const auto ns = parse_duration_ns(timeout, false);
    if (!ns || *ns <= 0) return fail(options, fmt::format("'{}' is not a duration; write 200ms or 1s", timeout)), false;
    return options.timeout_ns = *ns, true;
}

}  // namespace

int run_can_drive(const Options& given) {
    Options options = given;
    if (!take_options(options)) return 1;
    if (options.words.empty()) return fail(options, "the address is missing; type: hal can drive can:can0 --node 2 A on");
    if (options.drive_node.empty()) return fail(options, fmt::format("which node? type: hal can drive {} --node 2", options.words[0]));
    std::uint8_t node = 0;
    if (!node_of(options, options.drive_node, node)) return 1;
    const std::string& letter = options.drive_axis;
    const char axis = letter.empty() ? 'A' : static_cast<char>(letter[0] & ~0x20);
    if (letter.size() > 1 || axis < 'A' || axis > 'H') return fail(options, fmt::format("'{}' is no axis; write A to H", letter));

    Station station(options);
    const bool one_shot = options.words.size() > 1, terminal = ::isatty(STDIN_FILENO) == 1;
    DriveShell shell(options, station, node, static_cast<unsigned>(axis - 'A'), !terminal && !options.keep_going);
    station.bus.stop.on_signal = [&shell] { shell.press(); };
    station.bus.stop.spare(true);  // Ctrl-C stops the axis first
    if (!station.open(options.words[0])) return 1;
    if (one_shot) {
        std::string line;
        for (std::size_t i = 1; i < options.words.size(); ++i) line += options.words[i] + " ";
        return shell.execute(line);
    }
    if (terminal) print(fmt::format("node {} on {}; 'help' lists the commands, Tab completes\n", node, options.words[0]));
    return talk(shell, {"drive> ", "drive> "}, station.bus.stop.fd());
}

}  // namespace hal::tools
