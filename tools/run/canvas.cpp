// SPDX-License-Identifier: MIT
#include "run/canvas.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace hal::tools {

// A character is twice as high as wide, so the dots are square in Braille; else two columns make
// one dot.
Canvas::Canvas(std::size_t columns, std::size_t rows, bool unicode)
    : raster_(columns, rows, unicode),
      half_(static_cast<double>((std::min(raster_.width(), raster_.height()) - 1) / 2)) {}

void Canvas::dot(double x, double y) {
    const double column = static_cast<double>((raster_.width() - 1) / 2) + x * half_;

    const double row = static_cast<double>((raster_.height() - 1) / 2) - y * half_;
    if (!(column > -0.5 && row > -0.5 && column < static_cast<double>(raster_.width()) - 0.5 &&
          row < static_cast<double>(raster_.height()) - 0.5)) {
        return;  // NaN too
    }
    raster_.set(static_cast<std::size_t>(std::lround(column)),
                static_cast<std::size_t>(std::lround(row)));
}

void Canvas::line(double x0, double y0, double x1, double y1) {
    const double max = std::max(std::abs(x1 - x0), std::abs(y1 - y0)) * half_ * 2.0;
    if (!(max < 1e4)) return;
    const int steps = std::max(1, static_cast<int>(max));
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

}  // namespace hal::tools
