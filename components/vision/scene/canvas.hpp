// SPDX-License-Identifier: MIT
// Draws anti-aliased shapes: each pixel is blended with the shape's colour in proportion to the
// area that the shape covers.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace hal::vision::scene {

struct Point {
    double u = 0.0;
    double v = 0.0;  ///< px; the centre of the first pixel is 0, 0
};
using Colour = std::array<std::uint8_t, 3>;  ///< blue, green, red

/// A rod with round ends at one moment; a disc if both ends coincide.
struct Capsule {
    Point a, b;
    double radius_a = 1.0;
    double radius_b = 1.0;
};

class Canvas {
public:
    Canvas(int width, int height)
        : width_(width), height_(height), pixels_(static_cast<std::size_t>(width * height) * 3) {}
    int width() const noexcept { return width_; }
    int height() const noexcept { return height_; }
    std::vector<std::uint8_t>& pixels() noexcept { return pixels_; }

    /// Fills the canvas with a vertical gradient from `top` to `bottom`.
    void background(Colour top, Colour bottom);
    /// Draws one rod at several moments of the exposure, which gives motion blur.
    void capsule(std::span<const Capsule> moments, Colour colour);
    /// Fills a convex polygon; its corners are in clockwise order in the picture.
    void polygon(std::span<const Point> corners, Colour colour);
    /// Fills a rectangle; `cover(u, v)` returns the covered fraction of a pixel, 0 to 1.
    template <class Cover>
    void paint(double left, double top, double right, double bottom, Colour colour, Cover cover) {
        shade(left, top, right, bottom, [&](double u, double v, Colour& taken) {
            taken = colour;
            return cover(u, v);
        });
    }
    /// Fills a rectangle with a colour per pixel, which `cover(u, v, colour)` sets.
    template <class Cover>
    void shade(double left, double top, double right, double bottom, Cover cover) {
        Colour colour{};
        const int first_u = at_least(left, width_);
        const int last_u = at_most(right, width_);
        const int first_v = at_least(top, height_);
        const int last_v = at_most(bottom, height_);
        for (int v = first_v; v <= last_v; ++v) {
            for (int u = first_u; u <= last_u; ++u) {
                if (const double part =
                        cover(static_cast<double>(u), static_cast<double>(v), colour);
                    part > 0.0) {
                    mix(u, v, colour, part);
                }
            }
        }
    }
    void mix(int u, int v, Colour colour, double part) noexcept {
        std::uint8_t* const pixel = &pixels_[static_cast<std::size_t>(v * width_ + u) * 3];
        const int share = static_cast<int>(std::clamp(part, 0.0, 1.0) * 256.0 + 0.5);
        for (std::size_t i = 0; i < 3; ++i) {
            pixel[i] = static_cast<std::uint8_t>(
                (pixel[i] * (256 - share) + colour[i] * share + 128) >> 8);
        }
    }

private:
    static int at_least(double from, int size) noexcept {
        return static_cast<int>(std::clamp(std::floor(from), 0.0, static_cast<double>(size)));
    }
    static int at_most(double to, int size) noexcept {
        return static_cast<int>(std::clamp(std::ceil(to), -1.0, static_cast<double>(size - 1)));
    }

    int width_, height_;
    std::vector<std::uint8_t> pixels_;
};

}  // namespace hal::vision::scene
