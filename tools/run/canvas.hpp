// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "cli/raster.hpp"

namespace hal::tools {

/// A dot drawing for the terminal in square coordinates.
class Canvas {
public:
    /// `columns` x `rows` characters.
    Canvas(std::size_t columns, std::size_t rows, bool unicode);

    /// Coordinates are -1..1 in the largest centred square, y upwards. Points outside are not
    /// drawn.
    void dot(double x, double y);
    void line(double x0, double y0, double x1, double y1);
    void circle(double x, double y, double radius);

    /// Returns one text per row, each of `columns` characters.
    std::vector<std::string> rows() const { return raster_.rows(); }

private:
    Raster raster_;
    double half_;  // dots from the centre to the side of the square
};

}  // namespace hal::tools
