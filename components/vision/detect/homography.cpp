// SPDX-License-Identifier: MIT
#include "vision/detect/homography.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

namespace hal::vision {
namespace {
constexpr std::size_t least_points = 4, most_points = 1000;

std::string plural(std::size_t n, const char* what) { return std::to_string(n) + " " + what + (n == 1 ? "" : "s"); }

/// Four of these span a plane: no matter which line through two of them is taken, two others are off it.
bool spread(const std::vector<cv::Point2d>& p) {
    double size = 0;
    for (const auto& a : p) size = std::max(size, cv::norm(a - p[0]));
    for (std::size_t i = 0; i < p.size(); ++i)
        for (std::size_t j = i + 1; j < p.size(); ++j) {
            const cv::Point2d along = p[j] - p[i];
            std::size_t       off = 0;
            for (const auto& a : p) off += std::fabs(along.cross(a - p[i])) > 1e-3 * size * cv::norm(along);
            if (off < 2) return false;
        }
    return true;
}
}  // namespace

GroundText read_ground(std::string_view text) {
    GroundText result;
    const auto say = [&](std::size_t begin, std::size_t end, std::string sentence, std::string help) {
        if (result.problems.size() < 20)
            result.problems.push_back(
                {static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end), std::move(sentence), std::move(help)});
    };
    const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == ',' || c == ':'; };
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t   line = std::min(text.find('\n', at), text.size());
        const std::size_t   end = std::min({line, text.find(';', at), text.find('#', at)});
        std::vector<double> numbers;
        std::size_t         first = end, last = end;
        bool                good = true;
        for (std::size_t i = at; i < end && good;) {
            while (i < end && blank(text[i])) ++i;
            const std::size_t begin = i;
            while (i < end && !blank(text[i])) ++i;
            if (i == begin) break;
            first = std::min(first, begin), last = i;
            const std::string token(text.substr(begin, std::min<std::size_t>(i - begin, 60)));
            char*             rest = nullptr;
            const double      value = std::strtod(token.c_str(), &rest);
            good = *rest == '\0' && std::fabs(value) < 1e9;
            if (!good)
                say(begin, i, "'" + token + "' is not a number", "a row is u v x y: pixel from the left and from the top, then the place");
            numbers.push_back(value);
            if (numbers.size() > 4) break;
        }
        if (good && !numbers.empty()) {
            if (numbers.size() != 4)
                say(first, last,
                    "this point has " + (numbers.size() > 4 ? "more than 4 numbers" : plural(numbers.size(), "number") + ", not 4"),
                    "a row is u v x y: pixel from the left and from the top, then the place");
            else if (result.points.size() < most_points)
                result.points.push_back(
                    {numbers[0], numbers[1], numbers[2], numbers[3], static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last)});
        }
        at = end < line && text[end] == ';' ? end + 1 : line + 1;
    }
    if (result.problems.empty() && result.points.size() < least_points)
        say(0, std::min<std::size_t>(text.size(), 1), "there are " + plural(result.points.size(), "point") + ", and a plane takes four",
            "give four points that lie far apart, in rows of u v x y");
    return result;
}

Ground::Ground(GroundText& text, const std::optional<Camera>& camera) {
    if (text.problems.empty()) fit(text, camera);
}

void Ground::fit(GroundText& text, const std::optional<Camera>& camera) {
    if (camera) {
        camera_ = *camera;
        distorted_ = std::any_of(camera_.distortion.begin(), camera_.distortion.end(), [](double k) { return k != 0.0; });
    }
    std::vector<cv::Point2d> seen, there;
    for (const GroundPoint& p : text.points) {
        double u = p.u, v = p.v;
        undistort(u, v);
        seen.emplace_back(u, v);
        there.emplace_back(p.x, p.y);
    }
    const GroundPoint& any = text.points.front();
    const auto refuse = [&](const char* sentence, const char* help) { text.problems.push_back({any.begin, any.end, sentence, help}); };
    const char* const apart = "take the corners of a large square: of any three points none lies between the others";
    // all pairs of a hundred are enough to see it
    const auto few = [](std::vector<cv::Point2d> all) { return all.resize(std::min<std::size_t>(all.size(), 100)), all; };
    if (!spread(few(seen))) return refuse("the pixels of these points lie in a line, or two at one place", apart);
    if (!spread(few(there))) return refuse("these points lie in a line, or two at one place", apart);
    const cv::Mat h = cv::findHomography(seen, there, 0);
    if (h.empty() || !cv::checkRange(h)) return refuse("no plane fits these points", "look whether two of them are exchanged");
    std::copy(h.begin<double>(), h.end<double>(), h_.begin());
    double least = 1e300, most = -1e300, sum = 0;
    for (const auto& p : seen) {
        const double w = h_[6] * p.x + h_[7] * p.y + h_[8];
        least = std::min(least, w), most = std::max(most, w);
    }
    if (most < 0) {  // so that w is positive where the plane is
        for (double& value : h_) value = -value;
        std::swap(least, most), least = -least, most = -most;
    }
    if (least <= 0) return refuse("some of these points would be above the horizon", "look whether two of them are exchanged");
    least_w_ = 1e-3 * least;
    for (std::size_t i = 0; i < seen.size(); ++i) {
        double x = 0, y = 0;
        map(text.points[i].u, text.points[i].v, x, y);
        sum += (x - there[i].x) * (x - there[i].x) + (y - there[i].y) * (y - there[i].y);
    }
    error_ = std::sqrt(sum / static_cast<double>(seen.size()));
}

bool Ground::map(double u, double v, double& x, double& y) const noexcept {
    undistort(u, v);
    const double w = h_[6] * u + h_[7] * v + h_[8];
    if (!(w > least_w_)) return false;
    const double px = (h_[0] * u + h_[1] * v + h_[2]) / w, py = (h_[3] * u + h_[4] * v + h_[5]) / w;
    if (!std::isfinite(px) || !std::isfinite(py)) return false;
    x = px, y = py;
    return true;
}

// Brown's model has no inverse in closed form: xd = x radial + tangential, solved for x by repetition.
void Ground::undistort(double& u, double& v) const noexcept {
    if (!distorted_) return;
    const auto&  k = camera_.distortion;
    const double xd = (u - camera_.cx) / camera_.fx, yd = (v - camera_.cy) / camera_.fy;
    double       x = xd, y = yd;
    for (int turn = 0; turn < 20; ++turn) {
        const double r2 = x * x + y * y, radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
        const double tx = 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x), ty = k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y;
        x = (xd - tx) / radial, y = (yd - ty) / radial;
    }
    u = camera_.cx + camera_.fx * x, v = camera_.cy + camera_.fy * y;
}

}  // namespace hal::vision
