// SPDX-License-Identifier: MIT
// A line `KEY NUMBER NUMBER ...` of a file.
#pragma once

#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "text/config_text.hpp"
#include "text/numbers.hpp"
#include "text/quoting.hpp"

namespace hal::mobile {

/// Reads `words` from `first` on as numbers below 1e6, exactly `to.size()` of them; otherwise adds
/// a problem and returns false. [setup]
inline bool read_numbers(const std::vector<text::Word>& words, std::size_t first,
                         std::span<double> to, const std::string& form,
                         std::vector<text::Problem>& problems) {
    for (std::size_t i = 0; i < to.size() && first + i < words.size(); ++i) {
        const auto& word = words[first + i];
        const auto value = parse_real(word.text);
        if (!value || std::fabs(*value) >= 1e6) {
            text::add(
                problems, word.at.offset, word.at.offset + word.at.length,
                "'" + word.text.substr(0, 60) + "' is not a number" + (value ? " below 1e6" : ""),
                "write " + form);
            return false;
        }
        to[i] = *value;
    }
    const auto& last = words.back().at;
    if (words.size() != first + to.size()) {
        text::add(problems, words[0].at.offset, last.offset + last.length,
                  "'" + words[0].text.substr(0, 60) + "' has " +
                      counted(words.size() - first, "number") + ", expected " +
                      std::to_string(to.size()),
                  "write " + form);
        return false;
    }
    return true;
}

}  // namespace hal::mobile
