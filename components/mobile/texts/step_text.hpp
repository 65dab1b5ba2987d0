// SPDX-License-Identifier: MIT
// A program of steps, as in a sequential function chart (IEC 61131-3), in a text file:
//
//     input  cord reached full          # bits that conditions read
//     output drive collect              # bits that steps set
//     step wait                         # the program begins in its first step
//       when cord -> drive              # the first condition that is TRUE is taken, in the order of the lines
//     step drive
//       set drive                       # TRUE in this step only
//       when full and not reached -> wait
//       after 20s -> wait               # time since the step began
//     at 88s -> wait                    # time since the program left its first step; once; before any condition
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "text/config_text.hpp"

namespace hal::mobile {

struct Transition {
    std::uint64_t must = 0;
    std::uint64_t must_not = 0;  ///< inputs, a bit each
    std::int64_t after_ns = -1;  ///< -1: a condition
    std::uint32_t to = 0;
};
struct Step {
    std::string name;
    text::Span at;
    std::uint64_t outputs = 0;
    std::vector<Transition> transitions;
};

struct StepText {
    static constexpr std::size_t max_bits = 64;
    static constexpr std::size_t max_steps = 128;
    static constexpr std::size_t max_transitions = 32;

    std::vector<std::string> inputs, outputs;
    std::vector<Step> steps;
    std::vector<Transition> alarms;  ///< `at`, in order of time
    std::vector<text::Problem> problems;

    /// Reads the text of a file. [setup]
    void read(std::string_view text);
};

}  // namespace hal::mobile
