// SPDX-License-Identifier: MIT
#include "vision/detect/ground.hpp"

#include <algorithm>
#include <cmath>

namespace hal::vision {

Ground ground_before(const Mast& mast, int width, int height) {
    const double middle_u = 0.5 * (width - 1);
    const double middle_v = 0.5 * (height - 1);

    const double cos = std::cos(mast.pitch);
    const double sin = std::sin(mast.pitch);
    // Four pixels that show ground, and where: a pixel's ray falls by sin + down cos for each unit
    // along the camera's axis.
    const double horizon = middle_v - mast.focal * sin / std::max(cos, 1e-6);

    const double low = std::max<double>(height - 1, horizon + mast.focal);
    const double high = 0.5 * (low + std::max(0.0, horizon));
    GroundText text;
    for (const auto& [u, v] : {std::pair{0.0, low}, std::pair{width - 1.0, low},
                               std::pair{width - 1.0, high}, std::pair{0.0, high}}) {
        const double down = (v - middle_v) / mast.focal;
        const double far = mast.height / (sin + down * cos);
        text.points.push_back({u, v, 1e3 * (far * (cos - down * sin) + mast.forward),
                               -1e3 * far * (u - middle_u) / mast.focal});
    }
    return Ground(text, std::nullopt);
}

}  // namespace hal::vision
