// SPDX-License-Identifier: MIT
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

#include "tools/run/canvas.hpp"

namespace hal::tools {
namespace {

std::size_t marks(const Canvas& canvas, const std::string& blank) {
    std::size_t count = 0;
    for (const std::string& row : canvas.rows()) {
        for (std::size_t i = 0; i < row.size(); i += blank.size()) {
            count += row.compare(i, blank.size(), blank) != 0;
        }
    }
    return count;
}

TEST(Canvas, rows_have_the_asked_size_in_both_alphabets) {
    for (const bool unicode : {true, false}) {
        const auto rows = Canvas(7, 3, unicode).rows();
        ASSERT_EQ(rows.size(), 3u);
        for (const std::string& row : rows) {
            EXPECT_EQ(row.size(), unicode ? 21u : 7u);
        }
    }
}

TEST(Canvas, braille_dots_stand_where_they_are_drawn) {
    Canvas canvas(1, 1, true);  // 2 x 4 dots; the centre is the left of the second row
    canvas.dot(0, 0);
    EXPECT_EQ(canvas.rows().front(), "\u2802");
}

TEST(Canvas, plain_dots_are_halves_of_a_character) {
    Canvas upper(3, 1, false);  // 3 x 2 dots, the centre in the upper half
    upper.dot(0, 0);
    EXPECT_EQ(upper.rows().front(), " ' ");
}

TEST(Canvas, y_points_upwards) {
    Canvas canvas(9, 5, false);
    canvas.dot(0, 1);
    const auto rows = canvas.rows();
    EXPECT_NE(rows.front().find_first_not_of(' '), std::string::npos);
    EXPECT_EQ(rows.back().find_first_not_of(' '), std::string::npos);
}

TEST(Canvas, a_line_runs_from_side_to_side) {
    Canvas canvas(9, 5, true);  // 18 x 20 dots: the square is 17 dots wide
    canvas.line(-1, 0, 1, 0);
    const auto rows = canvas.rows();
    EXPECT_EQ(marks(canvas, "\u2800"), 9u);
    EXPECT_EQ(rows[2].substr(0, 3), "\u2812") << "both dots of the second line";
    EXPECT_EQ(rows[2].substr(24), "\u2802") << "the left one only";
}

TEST(Canvas, nothing_outside_is_drawn) {
    Canvas canvas(5, 3, true);
    const double infinity = std::numeric_limits<double>::infinity();
    for (const double bad : {5.0, -5.0, infinity, -infinity, std::nan("")}) {
        canvas.dot(bad, 0);
        canvas.dot(0, bad);
    }
    canvas.line(0, 0, infinity, 0);
    canvas.line(std::nan(""), 0, 1, 1);
    EXPECT_EQ(marks(canvas, "\u2800"), 0u);
}

TEST(Canvas, a_circle_keeps_its_radius) {
    Canvas canvas(11, 5, true);
    canvas.circle(0, 0, 0.5);
    Canvas inside(11, 5, true);
    for (double x = -0.15; x <= 0.15; x += 0.01) {
        inside.dot(x, 0);
    }
    const std::string ring = canvas.rows()[2];
    const std::string middle = inside.rows()[2];
    for (std::size_t i = 0; i < ring.size(); i += 3) {
        if (middle.compare(i, 3, "\u2800") != 0) {
            EXPECT_EQ(ring.substr(i, 3), "\u2800") << i;
        }
    }
}

}  // namespace
}  // namespace hal::tools
