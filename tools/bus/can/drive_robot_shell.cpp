// SPDX-License-Identifier: MIT
// The commands of the robot shell: NAME, the letter of the axis, `:` for a command or `?` for a
// query, integers. `ONA:`, `GB: -1000`, `PFA:4096,360`.
#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <fmt/core.h>

#include "bus/can/drive_shell.hpp"
#include "cli/output.hpp"
#include "text/diagnostic.hpp"

namespace hal::tools {

using namespace canopen::cia402;

struct DriveShell::RobotCommand {
    const char* name;
    unsigned values;        ///< after `:`
    bool commands, asks;    ///< allows `:`, `?`
    std::int64_t least, most;
    const char* value;      ///< the parameter or factor it stands for
    const char* what;
};

namespace {

constexpr std::int64_t least_i32 = INT32_MIN;
constexpr std::int64_t most_i32 = INT32_MAX;
constexpr std::int64_t most_u32 = UINT32_MAX;
constexpr std::int64_t step_limit = 15'000'000'000;

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
        const char* const first = part.data() + (part.starts_with('+') ? 1 : 0);
        const auto [end, error] = std::from_chars(first, part.data() + part.size(), value);
        if (part.empty() || error != std::errc() || end != part.data() + part.size()) return false;
        values.push_back(value);
        if (comma == text.npos) return true;
        text = text.substr(comma + 1);
        if (trimmed(text).empty()) return false;
    }
    return true;
}

}  // namespace

std::optional<bool> DriveShell::robot_line(std::string_view line) {
    static constexpr RobotCommand words[] = {
        {"ON", 0, true, false, 0, 0, nullptr, "switch the axis on"},
        {"OFF", 0, true, false, 0, 0, nullptr, "switch the axis off"},
        {"G", 1, true, false, least_i32, most_i32, nullptr,
         "go to a position; done when the drive has accepted it"},
        {"AP", 0, false, true, 0, 0, nullptr, "actual position"},
        {"MS", 1, true, true, 0, most_u32, "max-speed", "maximum speed of moves"},
        {"MA", 1, true, true, 0, most_u32, "max-acceleration", "maximum acceleration of moves"},
        {"SPD", 1, true, false, least_i32, most_i32, nullptr,
         "turn at a speed; done when the drive has accepted it"},
        {"STOP", 0, true, false, 0, 0, nullptr, "stop at once, in any mode"},
        {"PF", 2, true, true, 1, most_u32, "position-factor",
         "position factor: numerator, denominator"},
        {"VF", 2, true, true, 1, most_u32, "velocity-factor",
         "velocity factor: numerator, denominator"},
        {"AF", 2, true, true, 1, most_u32, "acceleration-factor",
         "acceleration factor: numerator, denominator"},
    };
    line = trimmed(line);
    if (line == "HELP") {
        std::string text = "  the last letter is the axis, A to H; ':' is a command, '?' a query\n";
        for (const RobotCommand& w : words) {
            const std::string typed =
                !w.commands ? fmt::format("{}A?", w.name)
                            : fmt::format("{0}A:{1}{2}", w.name,
                                          w.values == 2   ? "n,d"
                                          : w.values == 1 ? "n"
                                                          : "",
                                          w.asks ? fmt::format("   {}A?", w.name) : "");
            text += fmt::format("  {:16} {}\n", typed, w.what);
        }
        return print(text + "  HELP             print this list; help lists the other commands\n");
    }
    const auto end =
        static_cast<std::size_t>(std::find_if_not(line.begin(), line.end(), [](unsigned char c) {
        return std::isalnum(c) != 0;
    }) - line.begin());
    const std::string_view behind = trimmed(line.substr(end));
    if (end < 2 || behind.empty() || (behind[0] != ':' && behind[0] != '?')) return std::nullopt;
    std::string name(line.substr(0, end));
    const bool shouted = std::none_of(name.begin(), name.end(),
                                      [](unsigned char c) { return std::islower(c) != 0; });
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    const std::string stem = name.substr(0, name.size() - 1);
    const char letter = name.back();
    const auto named = [&](const std::string& text) {
        return std::find_if(std::begin(words), std::end(words),
                            [&](const RobotCommand& w) { return text == w.name; });
    };
    const RobotCommand* const word = named(stem);
    if (word == std::end(words) || letter < 'A' || letter > 'H') {
        if (!shouted) {
            return std::nullopt;  // a command of the other kind
        }
        if (named(name) != std::end(words)) {
            return wrong(
                fmt::format("missing axis in '{0}{1}'; write {0}A{1} to {0}H{1}", name, behind[0]));
        }
        if (word != std::end(words)) {
            return wrong(fmt::format("'{}' is not an axis; write {}A{} to {}H{}", letter, stem,
                                     behind[0], stem, behind[0]));
        }
        std::vector<std::string> names;
        for (const RobotCommand& w : words) {
            names.push_back(std::string(w.name) + letter);
        }
        const std::string hint = did_you_mean(name, names);
        return wrong(
            fmt::format("unknown command '{}'; {}", name, hint.empty() ? "type: HELP" : hint));
    }
    const bool query = behind[0] == '?';
    if (query ? !word->asks : !word->commands) {
        return wrong(fmt::format("{0} cannot be {1}; type: {0}{2}", name, query ? "queried" : "set",
                                 query ? ":" : "?"));
    }
    std::vector<std::int64_t> values;
    const unsigned wanted = query ? 0 : word->values;
    if (!parse_integers(trimmed(behind.substr(1)), values) || values.size() != wanted) {
        return wrong(wanted == 0
                         ? fmt::format("unexpected argument after {}{}", name, behind[0])
                         : fmt::format("{0}: takes {1} from {2} to {3}; type: {0}:{4}", name,
                                       wanted == 1 ? "one integer" : "two integers", word->least,
                                       word->most, wanted == 1 ? "1000" : "4096,360"));
    }
    for (const std::int64_t value : values) {
        if (value < word->least || value > word->most) {
            return wrong(fmt::format("{}: {} is out of range; write {} to {}", name, value,
                                     word->least, word->most));
        }
    }
    SdoAxis& a = axis(static_cast<unsigned>(letter - 'A'));
    a.allow(settings_.within_ns > 0 ? settings_.within_ns : step_limit);
    if (!robot_command(a, *word, values, query)) return false;
    return query || !settings_.prompt || print("ok\n");
}

bool DriveShell::robot_command(SdoAxis& a, const RobotCommand& word,
                               const std::vector<std::int64_t>& values, bool query) {
    const std::string_view name = word.name;
    const auto answer = [&](const std::string& value) {
        return print(fmt::format("{}{}={}\n", name, a.letter(), value));
    };
    if (name == "AP") {
        return a.look() && answer(fmt::format("{}", std::llround(a.position())));
    }
    if (word.values == 2) {
        Factor& factor = name == "PF"   ? a.rules.position
                         : name == "VF" ? a.rules.velocity
                                        : a.rules.acceleration;
        if (query) {
            return answer(fmt::format("{:.10g},{:.10g}", factor.numerator, factor.denominator));
        }
        if (settings_.one_shot) {
            return without_effect(
                fmt::format("{}{}:{},{}", name, a.letter(), values[0], values[1]));
        }
        factor = {static_cast<double>(values[0]), static_cast<double>(values[1])};
        return true;
    }
    if (word.value) {
        double value = 0;
        if (query) {
            return fetch(a, word.value, value) && answer(fmt::format("{}", std::llround(value)));
        }
        return store(a, word.value, static_cast<double>(values[0]), value);
    }
    if (name == "OFF") return a.off();
    if (name == "STOP") return a.stop();
    if (!watched(a)) return false;
    if (name == "ON") return a.on();
    if (name == "G") return a.go(static_cast<double>(values[0]), false, false, false);
    return a.speed(static_cast<double>(values[0]), false);
}

}  // namespace hal::tools
