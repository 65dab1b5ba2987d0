// SPDX-License-Identifier: MIT
#include "cli/raster.hpp"

#include <fmt/core.h>
#include <utility>

namespace hal::tools {

Raster::Raster(std::size_t columns, std::size_t rows, bool unicode)
    : columns_(columns),
      width_(unicode ? columns * 2 : columns),
      height_(rows * (unicode ? 4 : 2)),
      unicode_(unicode),
      dots_(columns * rows),
      colours_(columns * rows) {}

std::size_t Raster::cell(std::size_t x, std::size_t y) const {
    return unicode_ ? y / 4 * columns_ + x / 2 : y / 2 * columns_ + x;
}

void Raster::set(std::size_t x, std::size_t y, std::uint8_t colour) {
    if (x >= width_ || y >= height_) return;
    static constexpr std::uint8_t bits[4][2] = {
        {0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}};
    const std::size_t at = cell(x, y);
    dots_[at] |= unicode_ ? bits[y % 4][x % 2] : static_cast<std::uint8_t>(1U << y % 2);
    colours_[at] = colour;
}

void Raster::write(std::size_t column, std::size_t row, std::string sign, std::uint8_t colour) {
    if (column >= columns_ || row >= dots_.size() / columns_) return;
    const std::size_t at = row * columns_ + column;
    signs_[at] = std::move(sign);
    colours_[at] = colour;
}

bool Raster::taken(std::size_t x, std::size_t y) const {
    return x < width_ && y < height_ && dots_[cell(x, y)] != 0;
}

void Raster::append(std::string& to, std::size_t cell) const {
    if (const auto sign = signs_.find(cell); sign != signs_.end()) {
        to += sign->second;
        return;
    }
    const unsigned dots = dots_[cell];
    if (!unicode_) {
        static constexpr char marks[] = {' ', '\'', '.', ':'};
        to += marks[dots & 3];
        return;
    }
    // U+2800 + dots
    to += {static_cast<char>(0xE2), static_cast<char>(0xA0 | dots >> 6),
           static_cast<char>(0x80 | (dots & 0x3F))};
}

std::vector<std::string> Raster::rows() const {
    std::vector<std::string> text(columns_ == 0 ? 0 : dots_.size() / columns_);
    for (std::size_t i = 0; i < dots_.size(); ++i) {
        append(text[i / columns_], i);
    }
    return text;
}

std::vector<std::string> Raster::coloured_rows() const {
    std::vector<std::string> text(columns_ == 0 ? 0 : dots_.size() / columns_);
    for (std::size_t row = 0; row < text.size(); ++row) {
        std::uint8_t colour = 0;
        for (std::size_t i = row * columns_; i < (row + 1) * columns_; ++i) {
            const bool is_visible = dots_[i] != 0 || signs_.contains(i);
            if (is_visible && colours_[i] != colour) {
                colour = colours_[i];
                text[row] += colour == 0 ? "\033[39m" : fmt::format("\033[38;5;{}m", colour);
            }
            append(text[row], i);
        }
        if (colour != 0) {
            text[row] += "\033[39m";
        }
    }
    return text;
}

}  // namespace hal::tools
