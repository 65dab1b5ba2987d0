// SPDX-License-Identifier: MIT
#include <cmath>
#include <gtest/gtest.h>

#include "tools/scope/watch_table.hpp"

namespace hal::tools {
namespace {

TEST(WatchTable, has_value_extremes_and_rate_of_the_last_second) {
    WatchTable table({{"position", "mm", false, false}, {"pulse", "", true, true}, {"count", "", true, false}, {"nothing", "", false, false}});
    for (int i = 0; i <= 3000; ++i) {
        const std::int64_t now = i * 1'000'000LL;
        table.feed(0, {now, i < 1500 ? -0.5 : (i - 2000) * 0.002});
        table.feed(1, {now, static_cast<double>(i / 50 % 2)});
        table.feed(2, {now, static_cast<double>(i)});
    }
    const auto lines = table.lines();
    ASSERT_EQ(lines.size(), 5u);
    EXPECT_EQ(lines[0], "NAME              VALUE UNIT                MIN            MAX           RATE");
    EXPECT_EQ(lines[1], "position              2 mm                   -1              2         2 mm/s");
    EXPECT_EQ(lines[2], "pulse             FALSE                   FALSE           TRUE     20 edges/s");
    EXPECT_EQ(lines[3], "count              3000                       0           3000        1000 /s");
    EXPECT_EQ(lines[4], "nothing               -                       -              -              -");
}

TEST(WatchTable, reset_forgets_the_extremes_and_not_a_number_does_not_stay) {
    WatchTable table({{"x", "", false, false}});
    table.feed(0, {0, std::nan("")});
    table.feed(0, {1, 5});
    table.feed(0, {2, 3});
    EXPECT_EQ(table.lines()[1], "x                 3                       3              5              -");
    table.reset();
    EXPECT_EQ(table.lines()[1], "x                 3                       3              3              -");
}

}  // namespace
}  // namespace hal::tools
