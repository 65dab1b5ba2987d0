// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace hal::vision {

enum class Format : std::uint8_t { grey, bgr };  ///< 1 or 3 bytes per pixel

/// Maximum number of pixels: 64 MiB in colour.
constexpr int max_width = 8192;
constexpr int max_height = 8192;
constexpr std::size_t max_pixels = 22'000'000;

/// A picture and its exposure time. Owned by its creator, which reuses its memory for the next
/// frame.
struct Frame {
    int width = 0;
    int height = 0;
    Format format = Format::grey;
    std::int64_t stamp_ns = 0;  ///< exposure time on the runtime's clock
    std::uint64_t number = 0;    ///< frame number of the source; skipped frames count
    std::vector<std::uint8_t> pixels;        ///< rows without a gap, top left first

    int channels() const { return format == Format::grey ? 1 : 3; }
    std::size_t stride() const {
        return static_cast<std::size_t>(width) * static_cast<std::size_t>(channels());
    }
    /// Resizes the frame; its pixels are undefined. Returns false, without effect, if the size is
    /// empty or too large. [any]
    bool resize(int w, int h, Format f) {
        if (!fits(w, h)) return false;
        width = w;
        height = h;
        format = f;
        pixels.resize(stride() * static_cast<std::size_t>(h));
        return true;
    }
    static bool fits(int w, int h) {
        return w >= 1 && h >= 1 && w <= max_width && h <= max_height &&
               static_cast<std::size_t>(w) * static_cast<std::size_t>(h) <= max_pixels;
    }
    std::uint8_t* row(int y) { return pixels.data() + stride() * static_cast<std::size_t>(y); }
    const std::uint8_t* row(int y) const {
        return pixels.data() + stride() * static_cast<std::size_t>(y);
    }
};

/// Colour to grey in place, ITU-R BT.601-7 weights in 1/256; a grey frame stays. [any]
void to_grey(Frame& frame);

}  // namespace hal::vision
