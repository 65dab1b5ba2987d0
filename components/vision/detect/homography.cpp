// SPDX-License-Identifier: MIT
#include "vision/detect/homography.hpp"

#include "text/numbers.hpp"
#include "text/quoting.hpp"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace hal::vision {
namespace {
constexpr std::size_t min_points = 4;
constexpr std::size_t max_points = 1000;

/// Four of these span a plane: no matter which line through two of them is taken, two others are
/// off it.
bool spread(const std::vector<cv::Point2d>& p) {
    double size = 0;
    for (const auto& a : p) {
        size = std::max(size, cv::norm(a - p[0]));
    }
    for (std::size_t i = 0; i < p.size(); ++i) {
        for (std::size_t j = i + 1; j < p.size(); ++j) {
            const cv::Point2d along = p[j] - p[i];
            std::size_t off = 0;
            for (const auto& a : p) {
                off += std::fabs(along.cross(a - p[i])) > 1e-3 * size * cv::norm(along);
            }
            if (off < 2) return false;
        }
    }
    return true;
}
}  // namespace

GroundText read_ground(std::string_view text) {
    GroundText result;
    const char* const form =
        "write u v x y: pixel from the left and from the top, then the position on the ground";
    const auto point = [&](const text::Word& row) {
        std::vector<double> numbers;
        const auto words = text::words_of(row, ",:");
        if (words.empty()) return;
        for (const text::Word& word : words) {
            const auto value = parse_real(word.text);
            if (!value || std::fabs(*value) >= 1e9) {
                return text::add(result.problems, word.at.offset, word.at.offset + word.at.length,
                                 "'" + word.text.substr(0, 60) + "' is not a number", form);
            }
            numbers.push_back(*value);
            if (numbers.size() > 4) break;
        }
        const std::uint32_t first = words[0].at.offset;
        const std::uint32_t last =
            words[numbers.size() - 1].at.offset + words[numbers.size() - 1].at.length;
        if (numbers.size() != 4) {
            text::add(result.problems, first, last,
                      "this point has " + (numbers.size() > 4
                                               ? "more than 4 numbers"
                                               : counted(numbers.size(), "number") + ", not 4"),
                      form);
        } else if (result.points.size() < max_points) {
            result.points.push_back({numbers[0], numbers[1], numbers[2], numbers[3], first, last});
        }
    };
    text::Lines lines(text, "#");  // a `;` separates points
    while (const auto line = lines.next()) {
        for (const text::Word& row : text::list_of(*line, ';')) {
            point(row);
        }
    }
    if (result.problems.empty() && result.points.size() < min_points) {
        text::add(result.problems, 0, std::min<std::size_t>(text.size(), 1),
                  counted(result.points.size(), "point") + ", but a plane needs four",
                  "write four points that are far apart, one per row: u v x y");
    }
    return result;
}

Ground::Ground(GroundText& text, const std::optional<Camera>& camera) {
    if (text.problems.empty()) {
        fit(text, camera);
    }
}

void Ground::fit(GroundText& text, const std::optional<Camera>& camera) {
    if (camera) {
        camera_ = *camera;
        distorted_ = std::any_of(camera_.distortion.begin(), camera_.distortion.end(),
                                 [](double k) { return k != 0.0; });
    }
    std::vector<cv::Point2d> seen, there;
    for (const GroundPoint& p : text.points) {
        double u = p.u;
        double v = p.v;
        undistort(u, v);
        seen.emplace_back(u, v);
        there.emplace_back(p.x, p.y);
    }
    const GroundPoint& any = text.points.front();
    const auto refuse = [&](const char* sentence, const char* help) {
        text.problems.push_back({any.begin, any.end, sentence, help});
    };
    const char* const apart = "use the corners of a large square: no three points on a line";
    // all pairs of a hundred are enough to see it
    const auto few = [](std::vector<cv::Point2d> all) {
        all.resize(std::min<std::size_t>(all.size(), 100));
        return all;
    };
    if (!spread(few(seen))) {
        return refuse("the pixels of these points are collinear or coincide", apart);
    }
    if (!spread(few(there))) return refuse("these points are collinear or coincide", apart);
    const cv::Mat h = cv::findHomography(seen, there, 0);
    if (h.empty() || !cv::checkRange(h)) {
        return refuse("no plane fits these points", "check whether two of them are exchanged");
    }
    std::copy(h.begin<double>(), h.end<double>(), h_.begin());
    double min = 1e300;
    double max = -1e300;
    double sum = 0;
    for (const auto& p : seen) {
        const double w = h_[6] * p.x + h_[7] * p.y + h_[8];
        min = std::min(min, w);
        max = std::max(max, w);
    }
    if (max < 0) {  // so that w is positive where the plane is
        for (double& value : h_) {
            value = -value;
        }
        std::swap(min, max);
        min = -min;
        max = -max;
    }
    if (min <= 0) {
        return refuse("some of these points are above the horizon",
                      "check whether two of them are exchanged");
    }
    min_w_ = 1e-3 * min;
    for (std::size_t i = 0; i < seen.size(); ++i) {
        double x = 0;
        double y = 0;
        map(text.points[i].u, text.points[i].v, x, y);
        sum += (x - there[i].x) * (x - there[i].x) + (y - there[i].y) * (y - there[i].y);
    }
    error_ = std::sqrt(sum / static_cast<double>(seen.size()));
}

bool Ground::map(double u, double v, double& x, double& y) const noexcept {
    undistort(u, v);
    const double w = h_[6] * u + h_[7] * v + h_[8];
    if (!(w > min_w_)) return false;
    const double px = (h_[0] * u + h_[1] * v + h_[2]) / w;
    const double py = (h_[3] * u + h_[4] * v + h_[5]) / w;
    if (!std::isfinite(px) || !std::isfinite(py)) return false;
    x = px;
    y = py;
    return true;
}

// Brown's model has no inverse in closed form: xd = x radial + tangential, solved for x by
// repetition.
void Ground::undistort(double& u, double& v) const noexcept {
    if (!distorted_) return;
    const auto& k = camera_.distortion;
    const double xd = (u - camera_.cx) / camera_.fx;
    const double yd = (v - camera_.cy) / camera_.fy;
    double x = xd;
    double y = yd;
    for (int turn = 0; turn < 20; ++turn) {
        const double r2 = x * x + y * y;
        const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
        const double tx = 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x);

        const double ty = k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y;
        x = (xd - tx) / radial;
        y = (yd - ty) / radial;
    }
    u = camera_.cx + camera_.fx * x;
    v = camera_.cy + camera_.fy * y;
}

}  // namespace hal::vision
