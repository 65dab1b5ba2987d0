// SPDX-License-Identifier: MIT
#include "mobile/texts/goal_list.hpp"

#include <array>

#include "mobile/texts/number_line.hpp"

namespace hal::mobile {

void GoalList::read(std::string_view text) {
    for (text::Lines lines(text); const auto line = lines.next();) {
        const auto words = text::words_of(*line);
        std::array<double, 2> position{};
        if (words[0].text != "goal") {
            text::add(problems, words[0].at.offset, words[0].at.offset + words[0].at.length,
                      "unknown key '" + words[0].text.substr(0, 60) + "'",
                      "write goal X Y, in metres");
            continue;
        }
        if (!read_numbers(words, 1, position, "goal X Y, in metres", problems)) continue;
        if (goals.size() == max_goals) {
            text::add(problems, words[0].at.offset, words[0].at.offset + words[0].at.length,
                      "more than " + std::to_string(max_goals) + " goals", "split the list");
            return;
        }
        goals.push_back({position[0], position[1]});
    }
    if (goals.empty() && problems.empty()) {
        text::add(problems, 0, text.empty() ? 0 : 1, "the file has no goals",
                  "write goal X Y for each, in metres");
    }
}

}  // namespace hal::mobile
