// SPDX-License-Identifier: MIT
// A cycle as a line of text: a letter per participant.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "text/quoting.hpp"

namespace hal::tools {

/// Returns the letter of a participant; the letters repeat after 52. [any]
inline char strip_letter(std::size_t participant) {
    constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ";
    return letters[participant % letters.size()];
}

/// Returns "a master, b spare", of the participants that are used. [setup]
inline std::string strip_key(const std::vector<std::string>& names, const std::vector<bool>& used) {
    std::string key;
    for (std::size_t i = 0; i < names.size(); ++i) {
        if (!used[i]) continue;
        append_item(key, std::string(1, strip_letter(i)) + " " + names[i]);
    }
    return key;
}

}  // namespace hal::tools
