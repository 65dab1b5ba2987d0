// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "text/natural_order.hpp"

namespace hal::test {
namespace {

TEST(NaturalOrder, compares_digits_as_numbers) {
    std::vector<std::string> names{"axis10.x", "axis2.x",  "axis.x", "axis2", "joint.10.pos",
                                   "joint.9",  "axis02.x", "axis1",  "Axis3", ""};
    std::sort(names.begin(), names.end(), natural_less);
    EXPECT_EQ((std::vector<std::string>{"", "Axis3", "axis.x", "axis1", "axis2", "axis02.x",
                                        "axis2.x", "axis10.x", "joint.9", "joint.10.pos"}),
              names);
}

TEST(NaturalOrder, compares_numbers_of_any_length) {
    EXPECT_TRUE(natural_less("a99999999999999999999", "a100000000000000000000"));
    EXPECT_TRUE(natural_less("a00000000000000000001b", "a2"));
    EXPECT_TRUE(natural_less("a0", "a1"));
    EXPECT_TRUE(natural_less("a00", "a1"));
}

TEST(NaturalOrder, is_a_strict_total_order_in_which_only_equal_names_are_equal) {
    std::mt19937 random(7);
    std::vector<std::string> names;
    for (int i = 0; i < 120; ++i) {
        std::string name;
        for (auto k = random() % 5; k > 0; --k) {
            name += "01a.9\xC3"[random() % 6];
        }
        names.push_back(name);
    }
    for (const auto& a : names) {
        for (const auto& b : names) {
            EXPECT_EQ(a == b, compare_names(a, b) == 0) << a << ' ' << b;
            EXPECT_EQ(natural_less(a, b), compare_names(b, a) > 0) << a << ' ' << b;
            for (const auto& c : names) {
                if (natural_less(a, b) && natural_less(b, c)) {
                    EXPECT_TRUE(natural_less(a, c)) << a << ' ' << b << ' ' << c;
                }
            }
        }
    }
}

}  // namespace
}  // namespace hal::test
