// SPDX-License-Identifier: MIT
#include <cmath>
#include <gtest/gtest.h>

#include "text/glyphs.hpp"
#include "tools/scope/watch_table.hpp"

namespace hal::tools {
namespace {

TEST(WatchTable, has_value_extremes_and_rate_of_the_last_second) {
    WatchTable table({{"position", "mm", false, false},
                      {"pulse", "", true, true},
                      {"count", "", true, false},
                      {"nothing", "", false, false}});
    for (int i = 0; i <= 3000; ++i) {
        const std::int64_t now = i * 1'000'000LL;
        table.feed(0, {now, i < 1500 ? -0.5 : (i - 2000) * 0.002});
        table.feed(1, {now, static_cast<double>(i / 50 % 2)});
        table.feed(2, {now, static_cast<double>(i)});
    }
    const auto lines = table.lines();
    ASSERT_EQ(lines.size(), 5u);
    EXPECT_EQ(lines[0],
              "NAME              VALUE UNIT                MIN            MAX           RATE");
    EXPECT_EQ(lines[1],
              "position              2 mm                   -1              2         2 mm/s");
    EXPECT_EQ(lines[2],
              "pulse             FALSE                   FALSE           TRUE     20 edges/s");
    EXPECT_EQ(lines[3],
              "count              3000                       0           3000        1000 /s");
    EXPECT_EQ(lines[4],
              "nothing               -                       -              -              -");
}

TEST(WatchTable, the_unit_of_a_rate_has_one_more_second) {
    const auto rate = [](const char* unit) {
        WatchTable table({{"x", unit, false, false}});
        table.feed(0, {0, 0});
        table.feed(0, {500'000'000, 1});
        return table.texts(0).rate;
    };
    EXPECT_EQ(rate("m"), "2 m/s");
    EXPECT_EQ(rate("m/s"), "2 m/s^2");
    EXPECT_EQ(rate("rad/s^2"), "2 rad/s^3");
    EXPECT_EQ(rate("1/s^3"), "2 1/s^4");
    EXPECT_EQ(rate("N/sample"), "2 N/sample/s");
    EXPECT_EQ(rate(""), "2 /s");
}

TEST(WatchTable, reset_forgets_the_extremes_and_not_a_number_does_not_stay) {
    WatchTable table({{"x", "", false, false}});
    table.feed(0, {0, std::nan("")});
    table.feed(0, {1, 5});
    table.feed(0, {2, 3});
    EXPECT_EQ(table.lines()[1],
              "x                 3                       3              5              -");
    table.reset();
    EXPECT_EQ(table.lines()[1],
              "x                 3                       3              3              -");
}

TEST(WatchTable, shows_all_digits_of_64_bits) {
    WatchTable table(
        {{"s", "", true, false, Channel::Wide::s64}, {"u", "", true, false, Channel::Wide::u64}});
    for (const std::uint64_t word :
         {std::uint64_t{1} << 53 | 1, std::uint64_t{INT64_MAX}, std::uint64_t{UINT64_MAX}}) {
        table.feed(0, {0, static_cast<double>(static_cast<std::int64_t>(word)), word});
        table.feed(1, {0, static_cast<double>(word), word});
    }
    EXPECT_EQ(table.texts(0).value, "-1");
    EXPECT_EQ(table.texts(0).max, "9223372036854775807");
    EXPECT_EQ(table.texts(1).value, "18446744073709551615");
    EXPECT_EQ(table.texts(1).min, "9007199254740993");
}

TEST(WatchTable, a_narrow_terminal_loses_columns_and_never_a_value) {
    WatchTable table({{"axis.0.position-command", "mm", false, false},
                      {"axis.1.position-command", "mm", false, false}});
    for (std::size_t i = 0; i < 2; ++i) {
        table.feed(i, {0, 1.5 + static_cast<double>(i)});
    }
    EXPECT_EQ(table.lines(80)[1],
              "axis.0.position-command            1.5 mm                  1.5            1.5");
    EXPECT_EQ(table.lines(60)[1], "axis.0.position-command            1.5 mm      ");
    EXPECT_EQ(table.lines(40)[2], "axis.1.position-command            2.5");
    EXPECT_EQ(table.lines(32)[2], "…position-command            2.5");
    EXPECT_EQ(table.lines(1)[0], "NAME          VALUE");
    for (const std::size_t columns : {32, 40, 60, 80, 100, 200}) {
        for (const std::string& line : table.lines(columns)) {
            EXPECT_LE(hal::columns(line), columns) << line;
        }
    }
}

}  // namespace
}  // namespace hal::tools
