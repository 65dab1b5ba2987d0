// SPDX-License-Identifier: MIT
// A list of places to drive to: a line `X Y` for each, in metres.
#pragma once

#include <string_view>
#include <vector>

#include "text/config_text.hpp"

namespace hal::mobile {

struct Goal {
    double x, y;
};

struct GoalList {
    static constexpr std::size_t max_goals = 256;
    std::vector<Goal> goals;
    std::vector<text::Problem> problems;  ///< of the file; empty: it was valid

    /// Reads the text of a file. [setup]
    void read(std::string_view text);
};

}  // namespace hal::mobile
