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

cv::Mat grey_of(const Frame& frame) {
    const cv::Mat picture(frame.height, frame.width,
                          frame.format == Format::grey ? CV_8UC1 : CV_8UC3,
                          const_cast<std::uint8_t*>(frame.pixels.data()));
    if (frame.format != Format::bgr) return picture;
    cv::Mat grey;
    cv::cvtColor(picture, grey, cv::COLOR_BGR2GRAY);
    return grey;
}

/// Returns the uppermost row that is examined: from the lowest row to where the reach ends, or
/// where the width of a line has fewer than three pixels.
int top_row(const Frame& frame, const Ground& ground, const LineRules& rules) {
    const double middle = 0.5 * frame.width;
    double x = 0.0;
    double y = 0.0;
    double x2 = 0.0;
    double y2 = 0.0;
    for (int top = frame.height - 1; top > 0; --top) {
        const bool is_ground =
            place(ground, middle, top - 1, x, y) && place(ground, middle + 3.0, top - 1, x2, y2);
        if (!is_ground || x >= rules.reach || std::hypot(x2 - x, y2 - y) >= rules.width) return top;
    }
    return 0;
}

/// The mean of the rows `first` to `last`.
std::vector<float> mean_row(const cv::Mat& grey, int first, int last) {
    std::vector<float> row(static_cast<std::size_t>(grey.cols), 0.0F);
    for (int v = first; v <= last; ++v) {
        for (int u = 0; u < grey.cols; ++u) {
            row[static_cast<std::size_t>(u)] += static_cast<float>(grey.at<std::uint8_t>(v, u)) /
                                                static_cast<float>(last - first + 1);
        }
    }
    return row;
}

/// The points of a line in bands of `height` rows, from the lowest band up.
std::vector<LinePoint> points_in_bands(const cv::Mat& grey, int bands, int height,
                                       const Ground& ground, const LineRules& rules) {
    std::vector<LinePoint> points;
    const int half = std::min(height / 2, 2);
    for (int band = 0; band < bands; ++band) {
        const int middle = grey.rows - 1 - band * height - height / 2;
        const int first = std::max(middle - half, 0);
        const int last = std::min(middle + half, grey.rows - 1);
        look(mean_row(grey, first, last), 0.5 * (first + last), band, ground, rules, points);
    }
    return points;
}

/// Returns the points that agree with a parabola through `three`; none when that cannot be a line.
std::vector<LinePoint> supporters(const std::vector<LinePoint>& three,
                                  const std::vector<LinePoint>& points, const LineRules& rules) {
    constexpr double max_slope = 3.0;
    constexpr double max_bend = 5.0;  // 1/m
    Parabola through;
    if (!fit(three, rules.ahead, through)) return {};
    if (std::fabs(through.c) > max_bend || std::fabs(through.b) > max_slope) return {};
    return agreeing(points, through, rules.ahead, 0.5 * rules.width);
}

/// Returns the largest set of points on one parabola, found from each three of different bands.
std::vector<LinePoint> consensus(const std::vector<LinePoint>& points, const LineRules& rules) {
    std::vector<LinePoint> best;
    for (std::size_t i = 0; i < points.size(); ++i) {
        for (std::size_t j = i + 1; j < points.size(); ++j) {
            if (points[i].band == points[j].band) continue;
            for (std::size_t k = j + 1; k < points.size(); ++k) {
                if (points[j].band == points[k].band) continue;
                auto found = supporters({points[i], points[j], points[k]}, points, rules);
                if (found.size() > best.size()) {
                    best = std::move(found);
                }
            }
        }
    }
    return best;
}

}  // namespace

LineSeen find_line(const Frame& frame, const Ground& ground, const LineRules& rules) {
    LineSeen seen;
    const int bands = std::clamp(rules.bands, 3, 32);
    const int band_height = (frame.height - top_row(frame, ground, rules)) / bands;
    if (band_height < 1) return seen;
    const auto points = points_in_bands(grey_of(frame), bands, band_height, ground, rules);
    std::vector<LinePoint> best = consensus(points, rules);
    seen.quality = static_cast<double>(best.size()) / bands;
    Parabola line;
    if (!fit(best, rules.ahead, line)) return seen;
    seen.offset = line.a;
    seen.heading = std::atan(line.b);
    seen.curvature = 2.0 * line.c / std::pow(1.0 + line.b * line.b, 1.5);
    seen.points = std::move(best);
    seen.found = seen.quality >= rules.min_quality;
    return seen;
}

}  // namespace hal::vision
