// SPDX-License-Identifier: MIT
// The names of the pins of the component playback: for itself, and for what connects to it.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

namespace hal {

/// The pins and parameters of playback that are not values of a recording.
inline constexpr std::array<std::string_view, 6> playback_names = {"enable", "restart", "loop",
                                                                   "time",   "done",    "begin"};

/// Returns the pin of a recorded value: its name, with a prefix where playback has a pin of that
/// name itself. [setup]
inline std::string playback_pin(const std::string& value) {
    const bool is_taken =
        std::find(playback_names.begin(), playback_names.end(), value) != playback_names.end();
    return is_taken ? "value-" + value : value;
}

}  // namespace hal
