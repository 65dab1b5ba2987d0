// SPDX-License-Identifier: MIT
#include "vision/detect/line.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace hal::vision {

namespace {

constexpr std::size_t max_in_band = 3;

struct Parabola {
    double a = 0.0;
    double b = 0.0;
    double c = 0.0;
    double operator()(double x) const noexcept { return a + x * (b + x * c); }
};

/// The points of one row of the picture, a mean over the rows of its band.
void look(const std::vector<float>& row, double v, int band, const Ground& ground,
          const LineRules& rules, std::vector<LinePoint>& to) {
    const std::size_t n = row.size();
    std::vector<float> sorted = row;
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(n / 2),
                     sorted.end());
    const double floor = sorted[n / 2];
    const double sign = rules.dark ? -1.0 : 1.0;
    std::vector<double> out(n);
    double max = 0.0;
    for (std::size_t u = 0; u < n; ++u) {
        max = std::max(max, out[u] = sign * (row[u] - floor));
    }
    if (max < rules.contrast) return;
    const double threshold = std::max(0.5 * max, rules.contrast);
    std::vector<LinePoint> found;
    for (std::size_t u = 0; u < n;) {
        if (out[u] < threshold) {
            ++u;
            continue;
        }
        std::size_t end = u;
        while (end < n && out[end] >= threshold) {
            ++end;
        }
        const bool whole = u > 1 && end + 1 < n;  // one that the picture's edge cuts has no middle
        // its edges, between two pixels
        const double left =
            whole ? static_cast<double>(u) - (out[u] - threshold) / (out[u] - out[u - 1]) : 0.0;
        const double right = whole ? static_cast<double>(end - 1) +
                                         (out[end - 1] - threshold) / (out[end - 1] - out[end])
                                   : 0.0;
        LinePoint point{0.5 * (left + right), v, 0.0, 0.0, band};
        double x = 0.0;
        double y = 0.0;
        double x2 = 0.0;
        double y2 = 0.0;
        if (whole && place(ground, left, v, x, y) && place(ground, right, v, x2, y2) &&
            place(ground, point.u, v, point.x, point.y)) {
            if (const double width = std::hypot(x2 - x, y2 - y);
                width > 0.5 * rules.width && width < 2.0 * rules.width) {
                found.push_back(point);
            }
        }
        u = end;
    }
    std::sort(found.begin(), found.end(), [](const LinePoint& a, const LinePoint& b) {
        return std::fabs(a.y) < std::fabs(b.y);
    });
    if (found.size() > max_in_band) {
        found.resize(max_in_band);
    }
    to.insert(to.end(), found.begin(), found.end());
}

/// Least squares; false: no three places ahead of one another.
bool fit(const std::vector<LinePoint>& points, double ahead, Parabola& to) {
    cv::Matx33d m = cv::Matx33d::zeros();
    cv::Vec3d r(0, 0, 0);
    for (const LinePoint& p : points) {
        const double x = p.x - ahead;
        const cv::Vec3d powers(1.0, x, x * x);
        m += powers * powers.t();
        r += powers * p.y;
    }
    cv::Vec3d solved;
    if (points.size() < 3 || !cv::solve(m, r, solved, cv::DECOMP_CHOLESKY)) return false;
    to = {solved[0], solved[1], solved[2]};
    return std::isfinite(to.a + to.b + to.c);
}

std::vector<LinePoint> agreeing(const std::vector<LinePoint>& points, const Parabola& with,
                                double ahead, double tolerance) {
    std::vector<LinePoint> those;
    for (const LinePoint& p : points) {
        const double off = std::fabs(p.y - with(p.x - ahead));
        if (off > tolerance) continue;
        if (!those.empty() && those.back().band == p.band) {  // one of a band: the nearest
            if (off < std::fabs(those.back().y - with(those.back().x - ahead))) {
                those.back() = p;
            }
        } else {
            those.push_back(p);
        }
    }
    return those;
}

}  // namespace

LineSeen find_line(const Frame& frame, const Ground& ground, const LineRules& rules) {
    LineSeen seen;
    const cv::Mat picture(frame.height, frame.width,
                          frame.format == Format::grey ? CV_8UC1 : CV_8UC3,
                          const_cast<std::uint8_t*>(frame.pixels.data()));
    cv::Mat grey = picture;
    if (frame.format == Format::bgr) {
        cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
    }

    // from the lowest row to where the reach ends, or a line of the width has fewer than three
    // pixels
    const int bands = std::clamp(rules.bands, 3, 32);
    int top = frame.height - 1;
    double x = 0.0;
    double y = 0.0;
    double x2 = 0.0;
    double y2 = 0.0;
    while (top > 0 && place(ground, 0.5 * frame.width, top - 1, x, y) &&
           place(ground, 0.5 * frame.width + 3.0, top - 1, x2, y2) &&
           std::hypot(x2 - x, y2 - y) < rules.width && x < rules.reach) {
        --top;
    }
    const int each = (frame.height - top) / bands;
    if (each < 1) return seen;
    std::vector<LinePoint> points;
    for (int band = 0; band < bands; ++band) {
        const int middle = frame.height - 1 - band * each - each / 2;
        const int half = std::min(each / 2, 2);
        const int first = std::max(middle - half, 0);

        const int last = std::min(middle + half, frame.height - 1);
        std::vector<float> row(static_cast<std::size_t>(frame.width), 0.0F);
        for (int v = first; v <= last; ++v) {
            for (int u = 0; u < frame.width; ++u) {
                row[static_cast<std::size_t>(u)] +=
                    static_cast<float>(grey.at<std::uint8_t>(v, u)) /
                    static_cast<float>(last - first + 1);
            }
        }
        look(row, 0.5 * (first + last), band, ground, rules, points);
    }

    const double tolerance = 0.5 * rules.width;
    std::vector<LinePoint> best;
    Parabola through;
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (std::size_t j = i + 1; j < points.size(); ++j) {
            for (std::size_t k = j + 1; k < points.size(); ++k) {
                if (points[i].band == points[j].band || points[j].band == points[k].band) continue;
                if (!fit({points[i], points[j], points[k]}, rules.ahead, through) ||
                    std::fabs(through.c) > 5.0 || std::fabs(through.b) > 3.0) {
                    continue;
                }
                if (auto those = agreeing(points, through, rules.ahead, tolerance);
                    those.size() > best.size()) {
                    best = std::move(those);
                }
            }
        }
    }
    seen.quality = static_cast<double>(best.size()) / bands;
    if (!fit(best, rules.ahead, through)) return seen;
    seen.offset = through.a;
    seen.heading = std::atan(through.b);
    seen.curvature = 2.0 * through.c / std::pow(1.0 + through.b * through.b, 1.5);
    seen.points = std::move(best);
    seen.found = seen.quality >= rules.min_quality;
    return seen;
}

}  // namespace hal::vision
