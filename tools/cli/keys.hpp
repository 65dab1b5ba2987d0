// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace hal::tools {

enum class Code {
    character,
    up,
    down,
    left,
    right,
    page_up,
    page_down,
    tab,
    enter,
    backspace,
    escape
};

struct Key {
    Code code = Code::character;
    char character = 0;  ///< ASCII, of Code::character
    bool shift = false;  ///< of arrows
    bool operator==(const Key&) const = default;
};

/// Takes the complete keys from the beginning of `bytes`, as terminals send them (CSI and SS3
/// sequences), and skips unknown sequences.
/// `complete`: no more bytes came for a while, so a lone Esc is the key Esc.
std::vector<Key> pop_keys(std::string& bytes, bool complete);

}  // namespace hal::tools
