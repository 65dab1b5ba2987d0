// SPDX-License-Identifier: MIT
#include "vision/scene/render.hpp"

#include <opencv2/imgproc.hpp>

namespace hal::vision::scene {

namespace {

/// A hash that spreads well (G. Steele, D. Lea, C. Flood, *Fast splittable pseudorandom number
/// generators*, OOPSLA 2014).
std::uint64_t mixed(std::uint64_t x) noexcept {
    x += 0x9e3779b97f4a7c15U;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9U;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebU;
    return x ^ (x >> 31);
}

/// Numbers of a bell curve, times 64: the sum of twelve equal ones, which is the same on every
/// machine.
const std::vector<std::int16_t>& bell() {
    static const std::vector<std::int16_t> table = [] {
        std::vector<std::int16_t> made(1 << 16);
        std::uint64_t n = 1;
        for (auto& value : made) {
            double sum = -6.0;
            for (int i = 0; i < 12; ++i) {
                sum += static_cast<double>(mixed(++n) >> 11) * 0x1p-53;
            }
            value = static_cast<std::int16_t>(std::lround(sum * 64.0));
        }
        return made;
    }();
    return table;
}

/// Light and noise of the sensor: each row begins somewhere else in the table.
void develop(std::vector<std::uint8_t>& pixels, int height, double light, double noise,
             std::uint64_t seed) {
    const auto& table = bell();
    const int gain = static_cast<int>(std::clamp(light, 0.0, 16.0) * 256.0 + 0.5);

    const int sigma = static_cast<int>(std::clamp(noise, 0.0, 64.0) * 4.0 + 0.5);
    const std::size_t row = pixels.size() / static_cast<std::size_t>(height);
    for (std::size_t v = 0; v < static_cast<std::size_t>(height); ++v) {
        std::size_t at = mixed(seed + v) % table.size();
        std::uint8_t* const begin = &pixels[v * row];
        for (std::size_t i = 0; i < row; ++i) {
            begin[i] = static_cast<std::uint8_t>(
                std::clamp((begin[i] * gain + table[at] * sigma + 128) >> 8, 0, 255));
            at = at + 1 == table.size() ? 0 : at + 1;
        }
    }
}

}  // namespace

std::vector<std::uint8_t> render(const Settings& settings, const State& from, const State& to,
                                 std::uint64_t number) {
    Canvas canvas(settings.width, settings.height);
    switch (settings.kind) {
    case Kind::furuta: draw_furuta(canvas, settings, from, to); break;
    case Kind::floor: draw_floor(canvas, settings, to); break;
    case Kind::markers: draw_markers(canvas, settings, to); break;
    }
    if (const double covered = std::clamp(to[at::covered], 0.0, 1.0); covered > 0.0) {
        canvas.paint(
            0.0, 0.0, covered * settings.width + 1.0, settings.height, {24, 22, 20},
            [&](double u, double) { return std::clamp(covered * settings.width - u, 0.0, 1.0); });
    }
    std::vector<std::uint8_t> pixels = std::move(canvas.pixels());
    if (const double blur = std::clamp(to[at::blur], 0.0, 20.0); blur > 0.0) {
        const cv::Mat image(settings.height, settings.width, CV_8UC3, pixels.data());
        cv::GaussianBlur(image, image, {}, blur, blur, cv::BORDER_REPLICATE);
    }
    develop(pixels, settings.height, to[at::light], to[at::noise],
            mixed(settings.seed) + number * 65536);
    return pixels;
}

}  // namespace hal::vision::scene
