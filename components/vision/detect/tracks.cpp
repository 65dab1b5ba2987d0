// SPDX-License-Identifier: MIT
#include "vision/detect/tracks.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace hal::vision {

void Tracks::see(std::span<const Sighting> sightings, std::int64_t stamp_ns,
                 const TrackRules& rules) {
    struct Pair {
        double off;
        std::size_t track, sighting;
    };
    std::vector<Pair> pairs;
    for (std::size_t t = 0; t < count_; ++t) {
        for (std::size_t s = 0; s < sightings.size(); ++s) {
            const double off =
                std::hypot(tracks_[t].x - sightings[s].x, tracks_[t].y - sightings[s].y);
            if (tracks_[t].id != 0 && tracks_[t].kind == sightings[s].kind && off <= rules.gate) {
                pairs.push_back({off, t, s});
            }
        }
    }
    std::stable_sort(pairs.begin(), pairs.end(),
                     [](const Pair& a, const Pair& b) { return a.off < b.off; });
    std::vector<bool> met(sightings.size());
    std::array<bool, max_tracks> seen{};
    const double gain = std::clamp(rules.gain, 0.01, 1.0);
    for (const Pair& p : pairs) {
        if (seen[p.track] || met[p.sighting]) continue;
        seen[p.track] = met[p.sighting] = true;
        Track& track = tracks_[p.track];
        const Sighting& now = sightings[p.sighting];
        track.x += gain * (now.x - track.x);
        track.y += gain * (now.y - track.y);
        track.area = now.area;
        track.last_ns = stamp_ns;
        ++track.sightings;
    }
    for (std::size_t t = 0; t < count_; ++t) {
        if (tracks_[t].id != 0 && stamp_ns - tracks_[t].last_ns > rules.forget_ns) {
            tracks_[t] = {};
        }
    }
    for (std::size_t s = 0; s < sightings.size(); ++s) {
        if (met[s]) continue;
        const auto end = tracks_.begin() + static_cast<std::ptrdiff_t>(count_);
        const auto free =
            std::find_if(tracks_.begin(), end, [](const Track& t) { return t.id == 0; });
        if (free == end) {
            ++crowded_;
            continue;
        }
        *free = {next_,
                 sightings[s].kind,
                 sightings[s].x,
                 sightings[s].y,
                 sightings[s].area,
                 stamp_ns,
                 stamp_ns,
                 1};
        next_ = next_ == UINT32_MAX ? 1 : next_ + 1;
    }
}

}  // namespace hal::vision
