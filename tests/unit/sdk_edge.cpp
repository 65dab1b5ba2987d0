// SPDX-License-Identifier: MIT
// Edges of a bit from cycle to cycle.
#include <gtest/gtest.h>

#include <vector>

#include "hal/edge.hpp"

namespace hal::test {
namespace {

std::vector<bool> rises(RisingEdge edge, const std::vector<bool>& levels) {
    std::vector<bool> found;
    for (const bool level : levels) {
        found.push_back(edge.rises(level));
    }
    return found;
}

TEST(RisingEdge, rises_once_per_change_from_false_to_true) {
    const std::vector<bool> levels{false, true, true, false, true, false};
    EXPECT_EQ(rises(RisingEdge{}, levels),
              (std::vector<bool>{false, true, false, false, true, false}));
}

TEST(RisingEdge, rises_in_the_first_cycle_unless_the_level_before_it_is_true) {
    EXPECT_EQ(rises(RisingEdge{}, {true, true}), (std::vector<bool>{true, false}));
    EXPECT_EQ(rises(RisingEdge{true}, {true, false, true}),
              (std::vector<bool>{false, false, true}));
}

}  // namespace
}  // namespace hal::test
