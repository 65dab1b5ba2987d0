// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace hal::tools {

/// Dots for the terminal: 2 x 4 per character (Braille), or 1 x 2 without Unicode. A character has
/// one colour, that of its newest dot.
class Raster {
public:
    /// `columns` x `rows` characters.
    Raster(std::size_t columns, std::size_t rows, bool unicode);

    std::size_t width() const { return width_; }    ///< in dots
    std::size_t height() const { return height_; }  ///< in dots
    /// Sets a dot, x from the left, y from the top. `colour`: of the terminal's 256; 0: the default
    /// one. Outside: nothing.
    void set(std::size_t x, std::size_t y, std::uint8_t colour = 0);
    /// Shows a sign of one column in place of the dots of a character. Outside: nothing.
    void write(std::size_t column, std::size_t row, std::string sign, std::uint8_t colour = 0);
    /// Returns true when a character has a dot already.
    bool taken(std::size_t x, std::size_t y) const;

    /// Returns one text per row, each of `columns` characters.
    std::vector<std::string> rows() const;
    /// The same with escape sequences for the colours.
    std::vector<std::string> coloured_rows() const;

private:
    std::size_t cell(std::size_t x, std::size_t y) const;
    void append(std::string& to, std::size_t cell) const;

    std::size_t columns_, width_, height_;
    bool unicode_;
    /// per character: the bits of Braille, or 1 for the upper and 2 for the lower half
    std::vector<std::uint8_t> dots_, colours_;
    std::map<std::size_t, std::string> signs_;  // by character
};

}  // namespace hal::tools
