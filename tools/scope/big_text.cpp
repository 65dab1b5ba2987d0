// SPDX-License-Identifier: MIT
#include "scope/big_text.hpp"

#include <algorithm>
#include <string>

namespace hal::tools {

namespace {

constexpr std::size_t glyph_width = 3;
constexpr std::size_t glyph_height = 5;
constexpr std::size_t pitch = glyph_width + 1;

struct Shape {
    char character;
    const char* dots;  ///< five rows of three
};
constexpr Shape shapes[] = {
    {'0', "####.##.##.####"}, {'1', ".#.##..#..#.###"}, {'2', "###..#####..###"},
    {'3', "###..####..####"}, {'4', "#.##.####..#..#"}, {'5', "####..###..####"},
    {'6', "####..####.####"}, {'7', "###..#..#..#..#"}, {'8', "####.#####.####"},
    {'9', "####.####..####"}, {'-', "......###......"}, {'+', "....#.###.#...."},
    {'.', "............#.."}, {'e', "...####.##..###"}, {'T', "###.#..#..#..#."},
    {'R', "##.#.###.#.##.#"}, {'U', "#.##.##.##.####"}, {'E', "####..##.#..###"},
    {'F', "####..##.#..#.."}, {'A', "####.#####.##.#"}, {'L', "#..#..#..#..###"},
    {'S', "####..###..####"}, {'n', "...##.#.##.##.#"}, {'a', "...##..####.###"},
    {'i', ".#.....#..#..#."}, {'f', ".##.#.###.#..#."},
};

bool has_dot(char character, std::size_t x, std::size_t y) {
    const auto* const found =
        std::find_if(std::begin(shapes), std::end(shapes),
                     [&](const Shape& shape) { return shape.character == character; });
    return found != std::end(shapes) && x < glyph_width && found->dots[y * glyph_width + x] == '#';
}

}  // namespace

std::vector<std::string> big_text(std::string_view text, std::size_t columns, std::size_t rows,
                                  bool unicode) {
    const std::size_t width = text.size() * pitch - 1;
    // A dot is as wide as a character and half as high, or twice as wide as high without half
    // blocks.
    const std::size_t scale =
        text.empty()
            ? 0
            : std::min(columns / width, unicode ? rows * 2 / glyph_height : rows / glyph_height);
    if (scale == 0) {
        return {std::string(text)};
    }
    const auto dot = [&](std::size_t x, std::size_t y) {
        x /= scale;
        y /= scale;
        return y < glyph_height && x / pitch < text.size() &&
               has_dot(text[x / pitch], x % pitch, y);
    };
    std::vector<std::string> lines;
    const std::size_t height = glyph_height * scale;
    for (std::size_t y = 0; y < height; y += unicode ? 2 : 1) {
        std::string& line = lines.emplace_back();
        for (std::size_t x = 0; x < width * scale; ++x) {
            const bool upper = dot(x, y);
            const bool lower = dot(x, y + 1);
            if (!unicode) {
                line += upper ? '#' : ' ';
            } else if (upper) {
                line += lower ? "█" : "▀";
            } else {
                line += lower ? "▄" : " ";
            }
        }
    }
    return lines;
}

}  // namespace hal::tools
