// SPDX-License-Identifier: MIT
#include "run/replay_command.hpp"

#include <algorithm>
#include <charconv>
#include <fmt/core.h>
#include <iterator>
#include <system_error>

#include "run/stop_rule.hpp"

namespace hal::tools {

const ReplayCommands::Row ReplayCommands::rows[] = {
    {"step", &ReplayCommands::step},     {"back", &ReplayCommands::step},
    {"continue", &ReplayCommands::run},  {"reverse", &ReplayCommands::reverse},
    {"goto", &ReplayCommands::position}, {"break", &ReplayCommands::set_break},
    {"where", &ReplayCommands::where},
};

bool ReplayCommands::is_known(std::string_view name) {
    return std::ranges::any_of(rows, [name](const Row& row) { return row.name == name; });
}

std::string ReplayCommands::parse(Words words, Errand& errand) {
    const auto* const row = std::ranges::find(rows, std::string_view(words.at(0)), &Row::name);
    if (row == std::end(rows)) return fmt::format("unknown command '{}'", words[0]);
    return (this->*row->parse)(words, errand);
}

/// Returns why the words are invalid: [N] [THREAD].
std::string ReplayCommands::parse_step(Words words, std::size_t first, Errand& errand) {
    errand.count = 1;
    std::size_t at = first;
    if (at < words.size()) {
        const std::string& word = words[at];
        const char* const end = word.data() + word.size();
        const auto [rest, error] = std::from_chars(word.data(), end, errand.count);
        if (error == std::errc() && rest == end) {
            ++at;
        } else {
            errand.count = 1;
        }
        if (errand.count == 0) return "the number of cycles is 1 or more";
    }
    if (at < words.size()) {
        const std::string& name = words[at++];
        const bool is_known = std::ranges::any_of(
            file_.threads(), [&name](const auto& entry) { return entry.second.name == name; });
        if (!is_known || !store(errand.thread, name)) {
            return fmt::format("the journal has no thread '{}'", name);
        }
    }
    return at < words.size() ? fmt::format("unexpected '{}'", words[at]) : "";
}

std::string ReplayCommands::step(Words words, Errand& errand) {
    const bool is_back = words[0] == "back" || (words.size() > 1 && words[1] == "back");
    const std::size_t first = is_back && words[0] == "step" ? 2 : 1;
    if (const std::string problem = parse_step(words, first, errand); !problem.empty()) {
        return fmt::format("step: {}; write: step [back] [N] [THREAD]", problem);
    }
    errand.kind = is_back ? Errand::Kind::back : Errand::Kind::step;
    return "";
}

std::string ReplayCommands::run(Words words, Errand& errand) {
    if (words.size() != 1) return "continue: it has no arguments";
    errand.kind = Errand::Kind::run;
    store(errand.condition, condition_);
    return "";
}

std::string ReplayCommands::reverse(Words words, Errand& errand) {
    if (words.size() != 1) return "reverse: it has no arguments";
    if (condition_.empty()) return "reverse: no break condition; write: break NAME > VALUE";
    errand.kind = Errand::Kind::back;
    errand.count = 1;
    store(errand.condition, condition_);
    return "";
}

std::string ReplayCommands::position(Words words, Errand& errand) {
    JournalPosition position;
    if (words.size() != 2 || !position.parse(words[1]) || !store(errand.text, words[1])) {
        return "goto: write a cycle or a time: goto 12000, goto 3.5s";
    }
    errand.kind = Errand::Kind::position;
    return "";
}

/// Without a condition the errand is `where`.
std::string ReplayCommands::set_break(Words words, Errand& errand) {
    std::string text;
    for (std::size_t i = 1; i < words.size(); ++i) {
        text += (i == 1 ? "" : " ") + words[i];
    }
    ValueCondition condition;
    if (!text.empty() && (!condition.parse(text) || !store(errand.condition, text))) {
        return fmt::format("break: invalid condition '{}'; {}", text, ValueCondition::form);
    }
    condition_ = text;
    errand.kind = text.empty() ? Errand::Kind::where : Errand::Kind::check;
    return "";
}

std::string ReplayCommands::where(Words, Errand& errand) {
    errand.kind = Errand::Kind::where;
    return "";
}

}  // namespace hal::tools
