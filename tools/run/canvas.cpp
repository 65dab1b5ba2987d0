// SPDX-License-Identifier: MIT
#include "run/canvas.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hal::tools {

Canvas::Canvas(std::size_t columns, std::size_t rows, bool unicode)
    : columns_(columns), rows_(rows), dots_x_(columns * 2), dots_y_(rows * (unicode ? 4 : 2)), unicode_(unicode) {
    // A character is twice as high as wide, so the dots are square in Braille; else two columns make one dot.
    if (!unicode_) dots_x_ = columns;
    half_ = static_cast<double>((std::min(dots_x_, dots_y_) - 1) / 2);
    dots_.resize(dots_x_ * dots_y_);
}

void Canvas::dot(double x, double y) {
    const double column = static_cast<double>((dots_x_ - 1) / 2) + x * half_, row = static_cast<double>((dots_y_ - 1) / 2) - y * half_;
    if (!(column > -0.5 && row > -0.5 && column < static_cast<double>(dots_x_) - 0.5 && row < static_cast<double>(dots_y_) - 0.5))
        return;  // NaN too
    dots_[static_cast<std::size_t>(std::lround(row)) * dots_x_ + static_cast<std::size_t>(std::lround(column))] = true;
}

void Canvas::line(double x0, double y0, double x1, double y1) {
    const double longest = std::max(std::abs(x1 - x0), std::abs(y1 - y0)) * half_ * 2.0;
    if (!(longest < 1e4)) return;
    const int steps = std::max(1, static_cast<int>(longest));
    for (int i = 0; i <= steps; ++i) {
        const double t = static_cast<double>(i) / steps;
        dot(x0 + t * (x1 - x0), y0 + t * (y1 - y0));
    }
}

void Canvas::circle(double x, double y, double radius) {
    constexpr int steps = 240;
    for (int i = 0; i < steps; ++i) {
        const double angle = 2.0 * std::numbers::pi * i / steps;
        dot(x + radius * std::cos(angle), y + radius * std::sin(angle));
    }
}

std::vector<std::string> Canvas::rows() const {
    std::vector<std::string> text(rows_);
    const auto at = [&](std::size_t x, std::size_t y) { return dots_[y * dots_x_ + x]; };
    for (std::size_t row = 0; row < rows_; ++row)
        for (std::size_t column = 0; column < columns_; ++column) {
            if (!unicode_) {
                static constexpr char marks[] = {' ', '\'', '.', ':'};
                text[row] += marks[(at(column, 2 * row) ? 1 : 0) + (at(column, 2 * row + 1) ? 2 : 0)];
                continue;
            }
            static constexpr unsigned bits[4][2] = {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};
            unsigned cell = 0;
            for (std::size_t y = 0; y < 4; ++y)
                for (std::size_t x = 0; x < 2; ++x)
                    if (at(2 * column + x, 4 * row + y)) cell |= bits[y][x];
            text[row] +=
                {static_cast<char>(0xE2), static_cast<char>(0xA0 | cell >> 6), static_cast<char>(0x80 | (cell & 0x3F))};  // U+2800 + cell
        }
    return text;
}

}  // namespace hal::tools
