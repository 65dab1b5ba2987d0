// SPDX-License-Identifier: MIT
// Tracks objects on the ground over successive frames.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace hal::vision {

/// An object detected in one frame.
struct Sighting {
    std::uint32_t kind = 0;
    double x = 0.0;
    double y = 0.0;  ///< m
    double area = 0.0;        ///< px
};

/// An object tracked over successive frames.
struct Track {
    std::uint32_t id = 0;  ///< counts from 1; 0: this slot is free
    std::uint32_t kind = 0;
    double x = 0.0;
    double y = 0.0;
    double area = 0.0;
    /// stamps of the first and the last frame that showed it
    std::int64_t first_ns = 0;
    std::int64_t last_ns = 0;
    std::uint32_t sightings = 0;
};

struct TrackRules {
    /// m: maximum distance between a track and a detection of the same object
    double gate = 0.15;
    /// fraction by which a track moves towards a new detection, 0 to 1
    double gain = 0.5;
    std::int64_t forget_ns = 1'000'000'000;
};

constexpr std::size_t max_tracks = 32;

/// Assigns detections to tracks: the nearest pair of one kind first, then the nearest of the
/// remaining ones. A track keeps its slot as long as it exists.
class Tracks {
public:
    explicit Tracks(std::size_t count) : count_(count < max_tracks ? count : max_tracks) {}
    /// [any]
    void see(std::span<const Sighting> sightings, std::int64_t stamp_ns, const TrackRules& rules);
    std::span<const Track> all() const noexcept { return {tracks_.data(), count_}; }
    /// Returns the number of detections dropped because all tracks were in use. [any]
    std::uint32_t crowded() const noexcept { return crowded_; }

private:
    std::array<Track, max_tracks> tracks_{};
    std::size_t count_;
    std::uint32_t next_ = 1;
    std::uint32_t crowded_ = 0;
};

}  // namespace hal::vision
