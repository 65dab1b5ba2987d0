// SPDX-License-Identifier: MIT
#include "vision/detect/blob.hpp"

#include <cmath>

namespace hal::vision {

std::vector<Sighting> find_blobs(const Frame& frame, const Ground& ground,
                                 std::span<const BlobKind> kinds, const BlobRules& rules) {
    // where an ellipse is half as wide as it can be, in half axes
    constexpr double half_width = 0.8660254;
    std::vector<Sighting> sightings;
    std::vector<std::uint8_t> weights;
    for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
        weigh(frame, kinds[kind].hue, weights);
        for (const Spot& spot : find_spots(weights, frame.width, frame.height, rules.threshold,
                                           rules.min_area, max_tracks)) {
            double x = 0.0;
            double y = 0.0;
            double x_above = 0.0;
            double y_above = 0.0;
            if (spot.bottom >= frame.height - 2 || !place(ground, spot.foot_u, spot.foot_v, x, y) ||
                !place(ground, spot.foot_u, spot.foot_v - 1.0, x_above, y_above)) {
                continue;
            }
            // away from the camera is where the ground of the row above is
            const double away = std::hypot(x_above - x, y_above - y);
            if (!(away > 0.0)) continue;
            x += half_width * kinds[kind].radius * (x_above - x) / away;

            y += half_width * kinds[kind].radius * (y_above - y) / away;
            if (std::hypot(x, y) <= rules.max_distance) {
                sightings.push_back(
                    {static_cast<std::uint32_t>(kind), x, y, static_cast<double>(spot.area)});
            }
        }
    }
    return sightings;
}

}  // namespace hal::vision
