// SPDX-License-Identifier: MIT
#include "vision/detect/spots.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <opencv2/imgproc.hpp>

namespace hal::vision {

void weigh(const Frame& frame, Hue hue, std::vector<std::uint8_t>& weights) {
    const std::size_t count =
        static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height);
    weights.assign(count, 0);
    if (frame.format != Format::bgr) return;
    // chroma of a pixel: a = red - (green + blue) / 2, b = sqrt(3) / 2 (green - blue); in 1/4096
    const double angle = hue.degrees * std::numbers::pi / 180.0;

    const double narrow =
        1.0 / std::tan(std::clamp(hue.tolerance, 5.0, 85.0) * std::numbers::pi / 180.0);
    const double cos = std::cos(angle);
    const double sin = std::sin(angle);
    const double root = std::sqrt(3.0) / 2.0;
    const auto fixed = [](double value) { return static_cast<int>(std::lround(value * 4096.0)); };
    const int along_b = fixed(-0.5 * cos - root * sin);
    const int along_g = fixed(-0.5 * cos + root * sin);

    const int along_r = fixed(cos);
    const int across_b = fixed((0.5 * sin - root * cos) * narrow);

    const int across_g = fixed((0.5 * sin + root * cos) * narrow);
    const int across_r = fixed(-sin * narrow);
    const std::uint8_t* pixel = frame.pixels.data();
    for (std::size_t i = 0; i < count; ++i, pixel += 3) {
        const int along = along_b * pixel[0] + along_g * pixel[1] + along_r * pixel[2];
        const int across = across_b * pixel[0] + across_g * pixel[1] + across_r * pixel[2];
        weights[i] =
            static_cast<std::uint8_t>(std::clamp((along - std::abs(across)) >> 12, 0, 255));
    }
}

std::vector<Spot> find_spots(const std::vector<std::uint8_t>& weights, int width, int height,
                             int threshold, int min_area, std::size_t max) {
    // is only read
    const cv::Mat weight(height, width, CV_8UC1, const_cast<std::uint8_t*>(weights.data()));
    cv::Mat labels, stats, middles;
    const int count =
        cv::connectedComponentsWithStats(weight > threshold, labels, stats, middles, 8, CV_32S);
    std::vector<Spot> spots;
    for (int label = 1; label < count; ++label) {
        const int* const s = stats.ptr<int>(label);
        if (s[cv::CC_STAT_AREA] < min_area) continue;
        Spot spot;
        spot.area = s[cv::CC_STAT_AREA];
        spot.left = s[cv::CC_STAT_LEFT];
        spot.top = s[cv::CC_STAT_TOP];
        spot.right = spot.left + s[cv::CC_STAT_WIDTH] - 1;

        spot.bottom = spot.top + s[cv::CC_STAT_HEIGHT] - 1;
        // its rim lies below the threshold: what is next to it counts too
        std::vector<double> rows, moments;  // of each row: its weight, and that times u
        double sum = 0.0;
        double sum_u = 0.0;
        double sum_v = 0.0;
        for (int v = std::max(spot.top - 1, 0); v <= std::min(spot.bottom + 1, height - 1); ++v) {
            double row = 0.0;
            double moment = 0.0;
            for (int u = std::max(spot.left - 1, 0); u <= std::min(spot.right + 1, width - 1);
                 ++u) {
                if (const int other = labels.at<int>(v, u); other != label && other != 0) continue;
                const double w = weight.at<std::uint8_t>(v, u);
                row += w;
                moment += w * u;
            }
            sum_u += moment;
            sum_v += row * v;
            sum += row;
            rows.push_back(row);
            moments.push_back(moment);
        }
        if (!(sum > 0.0)) continue;
        spot.u = sum_u / sum;
        spot.v = sum_v / sum;
        spot.mass = sum / 255.0;
        // from below, the first row with half of the usual weight; between two rows by their
        // weights
        std::vector<double> sorted = rows;
        std::nth_element(sorted.begin(),
                         sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                         sorted.end());
        const double half = 0.5 * sorted[sorted.size() / 2];
        std::size_t last = rows.size() - 1;
        while (last > 0 && rows[last] < half) {
            --last;
        }
        const double next = last + 1 < rows.size() ? rows[last + 1] : 0.0;
        spot.foot_v =
            std::max(spot.top - 1, 0) + static_cast<double>(last) +
            (rows[last] > next ? std::clamp((rows[last] - half) / (rows[last] - next), 0.0, 1.0)
                               : 0.0);
        double foot = 0.0;
        for (std::size_t i = last > 2 ? last - 2 : 0; i <= last; ++i) {
            foot += rows[i];
            spot.foot_u += moments[i];
        }
        spot.foot_u = foot > 0.0 ? spot.foot_u / foot : spot.u;
        spots.push_back(spot);
    }
    std::sort(spots.begin(), spots.end(),
              [](const Spot& a, const Spot& b) { return a.mass > b.mass; });
    if (spots.size() > max) {
        spots.resize(max);
    }
    return spots;
}

}  // namespace hal::vision
