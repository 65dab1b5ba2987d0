// SPDX-License-Identifier: MIT
#include "vision/detect/pendulum.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace hal::vision {

namespace {

using Middles = std::array<double, 4>;  // u and v of the pivot's ball, then of the other

/// Where the camera sees the balls. The camera is at (distance, 0, height) and looks at 0; its
/// picture's axes are the world's y, and (sin tilt, 0, -cos tilt) with tilt the angle it looks
/// down.
class Eye {
public:
    explicit Eye(const PendulumView& view)
        : view_(view),
          far_(std::hypot(view.height, view.distance)),
          cos_tilt_(view.distance / far_),
          sin_tilt_(view.height / far_) {}

    Middles at(double arm, double pendulum) const {
        const double cos = std::cos(arm);
        const double sin = std::sin(arm);

        const double swing = view_.rod_length * std::sin(pendulum);
        const double place[2][3] = {
            {view_.arm_length * cos, view_.arm_length * sin, 0.0},
            {view_.arm_length * cos - swing * sin, view_.arm_length * sin + swing * cos,
             -view_.rod_length * std::cos(pendulum)}};
        Middles middles{};
        for (std::size_t i = 0; i < 2; ++i) {
            const double ahead =
                std::fmax(far_ - place[i][0] * cos_tilt_ - place[i][2] * sin_tilt_, 0.01);
            middles[2 * i] = view_.middle_u + view_.focal_u * place[i][1] / ahead;
            middles[2 * i + 1] =
                view_.middle_v +
                view_.focal_v * (place[i][0] * sin_tilt_ - place[i][2] * cos_tilt_) / ahead;
        }
        return middles;
    }

private:
    const PendulumView& view_;
    const double far_, cos_tilt_, sin_tilt_;
};

double squared(const Middles& a, const Middles& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        sum += (a[i] - b[i]) * (a[i] - b[i]);
    }
    return sum;
}

struct Angles {
    double arm = 0.0;
    double pendulum = 0.0;
    double residual = 1e300;
    double sigma = 1e300;
};

double turned(double a, double b) {
    return std::fabs(std::remainder(a - b, 2.0 * std::numbers::pi));
}

/// Down the valley that `from` lies in.
Angles descend(const Eye& eye, const Middles& measured, Angles from) {
    constexpr double small = 1e-6;
    constexpr double middles_sigma = 0.05;
    for (int turn = 0; turn < 12; ++turn) {
        const Middles at = eye.at(from.arm, from.pendulum);

        const Middles by_arm = eye.at(from.arm + small, from.pendulum);

        const Middles by_pendulum = eye.at(from.arm, from.pendulum + small);
        double aa = 1e-9;
        double ap = 0.0;
        double pp = 1e-9;
        double ra = 0.0;
        double rp = 0.0;  // the normal equations
        for (std::size_t i = 0; i < at.size(); ++i) {
            const double da = (by_arm[i] - at[i]) / small;
            const double dp = (by_pendulum[i] - at[i]) / small;

            const double off = measured[i] - at[i];
            aa += da * da;
            ap += da * dp;
            pp += dp * dp;
            ra += da * off;
            rp += dp * off;
        }
        const double determinant = aa * pp - ap * ap;
        if (!(determinant > 1e-9)) {
            return {};
        }
        from.sigma = middles_sigma * std::sqrt(std::fmax(aa, pp) / determinant);
        const double to_arm = (pp * ra - ap * rp) / determinant;

        const double to_pendulum = (aa * rp - ap * ra) / determinant;
        // half the step while it leads away
        double part = 1.0;
        while (part > 0.01 &&
               squared(eye.at(from.arm + part * to_arm, from.pendulum + part * to_pendulum),
                       measured) > squared(at, measured)) {
            part *= 0.5;
        }
        from.arm += part * to_arm;
        from.pendulum += part * to_pendulum;
        if (std::fabs(to_arm) + std::fabs(to_pendulum) < 1e-6) break;
    }
    from.arm = std::remainder(from.arm, 2.0 * std::numbers::pi);

    from.pendulum = std::remainder(from.pendulum, 2.0 * std::numbers::pi);
    from.residual = std::sqrt(squared(eye.at(from.arm, from.pendulum), measured) / 4.0);
    return from;
}

}  // namespace

bool fit_pendulum(const PendulumView& view, double pivot_u, double pivot_v, double tip_u,
                  double tip_v, PendulumSeen& seen) {
    constexpr int grid = 36;
    constexpr double step = 2.0 * std::numbers::pi / grid;
    constexpr double same = 0.01;
    const Middles measured{pivot_u, pivot_v, tip_u, tip_v};
    const Eye eye(view);
    std::array<double, grid * grid> off{};
    const auto at = [&](int i, int j) -> double& {
        return off[static_cast<std::size_t>((i + grid) % grid * grid + (j + grid) % grid)];
    };
    for (int i = 0; i < grid; ++i) {
        for (int j = 0; j < grid; ++j) {
            at(i, j) = squared(eye.at(i * step, j * step), measured);
        }
    }
    // px²: half a step of the grid moves the balls by much less than that
    const double too_far = 0.2 * view.focal_u * view.focal_u;
    Angles best, rival;
    for (int i = 0; i < grid; ++i) {
        for (int j = 0; j < grid; ++j) {
            // a valley that lies askew is none of the grid's in both directions
            const double here = at(i, j);
            if (here > too_far) continue;
            if (!(here <= at(i, j - 1) && here <= at(i, j + 1)) &&
                !(here <= at(i - 1, j) && here <= at(i + 1, j))) {
                continue;
            }
            const Angles found = descend(eye, measured, {i * step, j * step});
            if (found.residual >= rival.residual) continue;
            if (turned(found.arm, best.arm) < same &&
                turned(found.pendulum, best.pendulum) < same && best.residual < 1e300) {
                if (found.residual < best.residual) {
                    best = found;
                }
            } else if (found.residual < best.residual) {
                rival = best;
                best = found;
            } else if (found.residual < rival.residual) {
                rival = found;
            }
        }
    }
    seen.arm = best.arm;
    seen.pendulum = best.pendulum;
    seen.residual = best.residual;
    seen.rival = rival.residual;
    seen.sigma = best.sigma;
    return std::isfinite(seen.arm + seen.pendulum) && seen.residual < 1e300;
}

PendulumSeen find_pendulum(const Frame& frame, const PendulumView& view,
                           const PendulumLimits& limits) {
    PendulumSeen seen;
    std::vector<std::uint8_t> weights;
    weigh(frame, limits.pivot, weights);
    const auto pivots =
        find_spots(weights, frame.width, frame.height, limits.threshold, limits.min_area, 1);
    weigh(frame, limits.tip, weights);
    const auto tips =
        find_spots(weights, frame.width, frame.height, limits.threshold, limits.min_area, 1);
    if (pivots.empty() || tips.empty()) return seen;
    seen.pivot_ball = pivots[0];
    seen.tip_ball = tips[0];
    constexpr double unlike = 0.5;  // px: ten times what the middles are off
    seen.found = fit_pendulum(view, pivots[0].u, pivots[0].v, tips[0].u, tips[0].v, seen) &&
                 seen.residual <= limits.max_residual &&
                 seen.rival > std::fmax(unlike, 3.0 * seen.residual) &&
                 seen.sigma <= limits.max_sigma;
    return seen;
}

}  // namespace hal::vision
