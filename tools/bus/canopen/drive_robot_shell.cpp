// SPDX-License-Identifier: MIT
#include "bus/canopen/drive_robot_shell.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fmt/core.h>

#include "cli/output.hpp"
#include "text/characters.hpp"
#include "text/diagnostic.hpp"
#include "text/find_row.hpp"
#include "text/numbers.hpp"

namespace hal::tools {

using namespace cia402;

struct RobotShell::Command {
    const char* name;
    unsigned values;                  ///< after `:`
    bool can_set, can_query;          ///< allows `:`, `?`
    std::int64_t min, max;            ///< of a value
    const char* parameter;            ///< its name in DriveValues
    Factor AxisRules::* factor;        ///< or the factor
    const char* what;
};

/// `PFA: 4096,360` is the name PFA (stem PF, axis A), `:`, and the arguments 4096,360.
struct RobotShell::Line {
    std::string name;  ///< in upper case
    bool is_upper_case = false;
    bool query = false;
    std::string_view arguments;

    std::string stem() const { return name.substr(0, name.size() - 1); }
    char letter() const { return name.back(); }
    bool has_axis() const { return letter() >= 'A' && letter() <= 'H'; }
    unsigned axis() const { return static_cast<unsigned>(letter() - 'A'); }
    char mark() const { return query ? '?' : ':'; }
};

namespace {

constexpr std::int64_t min_i32 = INT32_MIN;
constexpr std::int64_t max_i32 = INT32_MAX;
constexpr std::int64_t max_u32 = UINT32_MAX;
constexpr std::int64_t command_timeout_ns = 15'000'000'000;

std::string_view trimmed(std::string_view text) {
    const auto from = text.find_first_not_of(" \t\r\n");
    if (from == text.npos) {
        return {};
    }
    return text.substr(from, text.find_last_not_of(" \t\r\n") - from + 1);
}

/// Parses integers separated by commas. Returns false for anything else.
bool parse_integers(std::string_view text, std::vector<std::int64_t>& values) {
    while (!text.empty()) {
        const auto comma = text.find(',');
        const std::string_view part = trimmed(text.substr(0, comma));
        std::int64_t value = 0;
        if (!parse_whole(part.substr(part.starts_with('+') ? 1 : 0), value)) return false;
        values.push_back(value);
        if (comma == text.npos) return true;
        text = text.substr(comma + 1);
        if (trimmed(text).empty()) return false;
    }
    return true;
}

bool is_lower_case(char c) { return std::islower(static_cast<unsigned char>(c)) != 0; }

}  // namespace

const RobotShell::Command RobotShell::commands[] = {
    {"ON", 0, true, false, 0, 0, nullptr, nullptr, "switch the axis on"},
    {"OFF", 0, true, false, 0, 0, nullptr, nullptr, "switch the axis off"},
    {"G", 1, true, false, min_i32, max_i32, nullptr, nullptr,
     "go to a position; done when the drive has accepted it"},
    {"AP", 0, false, true, 0, 0, nullptr, nullptr, "actual position"},
    {"MS", 1, true, true, 0, max_u32, "max-speed", nullptr, "maximum speed of moves"},
    {"MA", 1, true, true, 0, max_u32, "max-acceleration", nullptr, "maximum acceleration of moves"},
    {"SPD", 1, true, false, min_i32, max_i32, nullptr, nullptr,
     "turn at a speed; done when the drive has accepted it"},
    {"STOP", 0, true, false, 0, 0, nullptr, nullptr, "stop at once, in any mode"},
    {"PF", 2, true, true, 1, max_u32, nullptr, &AxisRules::position,
     "position factor: numerator, denominator"},
    {"VF", 2, true, true, 1, max_u32, nullptr, &AxisRules::velocity,
     "velocity factor: numerator, denominator"},
    {"AF", 2, true, true, 1, max_u32, nullptr, &AxisRules::acceleration,
     "acceleration factor: numerator, denominator"},
};

const RobotShell::Command* RobotShell::find_command(std::string_view name) {
    return find_row(commands, name, &Command::name);
}

std::string RobotShell::usage(const Command& c) {
    if (!c.can_set) return fmt::format("{}A?", c.name);
    constexpr const char* placeholders[] = {"", "n", "n,d"};
    std::string text = fmt::format("{}A:{}", c.name, placeholders[c.values]);
    if (c.can_query) {
        text += fmt::format("   {}A?", c.name);
    }
    return text;
}

bool RobotShell::help() const {
    std::string text = "  the last letter is the axis, A to H; ':' is a command, '?' a query\n";
    for (const Command& c : commands) {
        text += fmt::format("  {:16} {}\n", usage(c), c.what);
    }
    return print(text + "  HELP             print this list; help lists the other commands\n");
}

/// Returns nullopt for a line without the form of a command.
std::optional<RobotShell::Line> RobotShell::parse(std::string_view text) {
    const auto* const name_end = std::find_if_not(text.begin(), text.end(), is_alphanumeric);
    const auto length = static_cast<std::size_t>(name_end - text.begin());
    const std::string_view rest = trimmed(text.substr(length));
    if (length < 2 || rest.empty()) return std::nullopt;
    if (rest[0] != ':' && rest[0] != '?') return std::nullopt;
    Line line;
    line.name = text.substr(0, length);
    line.is_upper_case = std::none_of(line.name.begin(), line.name.end(), is_lower_case);
    std::transform(line.name.begin(), line.name.end(), line.name.begin(), upper);
    line.query = rest[0] == '?';
    line.arguments = trimmed(rest.substr(1));
    return line;
}

/// Reports an unknown name. In lower case it may be a command of the other kind.
std::optional<bool> RobotShell::unknown(const Line& line) const {
    if (!line.is_upper_case) return std::nullopt;
    if (find_command(line.name)) {
        return session_.wrong(fmt::format("missing axis in '{0}{1}'; write {0}A{1} to {0}H{1}",
                                          line.name, line.mark()));
    }
    if (find_command(line.stem())) {
        return session_.wrong(fmt::format("'{0}' is not an axis; write {1}A{2} to {1}H{2}",
                                          line.letter(), line.stem(), line.mark()));
    }
    std::vector<std::string> names;
    for (const Command& c : commands) {
        names.push_back(std::string(c.name) + line.letter());
    }
    const std::string hint = did_you_mean(line.name, names);
    return session_.wrong(
        fmt::format("unknown command '{}'; {}", line.name, hint.empty() ? "type: HELP" : hint));
}

bool RobotShell::parse_values(const Line& line, const Command& command, Integers& values) const {
    const unsigned count = line.query ? 0 : command.values;
    if (!parse_integers(line.arguments, values) || values.size() != count) {
        if (count == 0) {
            return session_.wrong(
                fmt::format("unexpected argument after {}{}", line.name, line.mark()));
        }
        const bool one = count == 1;
        return session_.wrong(fmt::format("{0}: takes {1} from {2} to {3}; type: {0}:{4}",
                                          line.name, one ? "one integer" : "two integers",
                                          command.min, command.max, one ? "1000" : "4096,360"));
    }
    for (const std::int64_t value : values) {
        if (value >= command.min && value <= command.max) continue;
        return session_.wrong(fmt::format("{}: {} is out of range; write {} to {}", line.name,
                                          value, command.min, command.max));
    }
    return true;
}

std::optional<bool> RobotShell::execute(std::string_view text) {
    text = trimmed(text);
    if (text == "HELP") return help();
    const std::optional<Line> line = parse(text);
    if (!line) return std::nullopt;
    const Command* const command = find_command(line->stem());
    if (!command || !line->has_axis()) return unknown(*line);
    if (line->query && !command->can_query) {
        return session_.wrong(fmt::format("{0} cannot be queried; type: {0}:", line->name));
    }
    if (!line->query && !command->can_set) {
        return session_.wrong(fmt::format("{0} cannot be set; type: {0}?", line->name));
    }
    Integers values;
    if (!parse_values(*line, *command, values)) return false;
    SdoAxis& axis = session_.axis(line->axis());
    const std::int64_t within_ns = session_.settings().within_ns;
    axis.allow(within_ns > 0 ? within_ns : command_timeout_ns);
    if (!run(axis, *command, values, line->query)) return false;
    return line->query || !session_.settings().prompt || print("ok\n");
}

bool RobotShell::answer(const SdoAxis& a, const Command& command, const std::string& value) const {
    return print(fmt::format("{}{}={}\n", command.name, a.letter(), value));
}

bool RobotShell::factor(SdoAxis& a, const Command& command, const Integers& values, bool query) {
    Factor& factor = a.rules.*command.factor;
    if (query) {
        return answer(a, command,
                      fmt::format("{:.10g},{:.10g}", factor.numerator, factor.denominator));
    }
    if (session_.settings().one_shot) {
        return session_.without_effect(
            fmt::format("{}{}:{},{}", command.name, a.letter(), values[0], values[1]));
    }
    factor = {static_cast<double>(values[0]), static_cast<double>(values[1])};
    return true;
}

bool RobotShell::parameter(SdoAxis& a, const Command& command, const Integers& values, bool query) {
    double value = 0;
    if (!query) {
        return values_.store(a, command.parameter, static_cast<double>(values[0]), value);
    }
    return values_.fetch(a, command.parameter, value) &&
           answer(a, command, fmt::format("{}", std::llround(value)));
}

bool RobotShell::run(SdoAxis& a, const Command& command, const Integers& values, bool query) {
    if (command.factor) return factor(a, command, values, query);
    if (command.parameter) return parameter(a, command, values, query);
    const std::string_view name = command.name;
    if (name == "AP") {
        return a.look() && answer(a, command, fmt::format("{}", std::llround(a.position())));
    }
    if (name == "OFF") return a.off();
    if (name == "STOP") return a.stop();
    if (!session_.watched(a)) return false;
    if (name == "ON") return a.on();
    if (name == "G") return a.go(static_cast<double>(values[0]), false, false, false);
    return a.speed(static_cast<double>(values[0]), false);
}

}  // namespace hal::tools
