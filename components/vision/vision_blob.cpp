// SPDX-License-Identifier: MIT
#include <array>

#include "vision/camera_component.hpp"
#include "vision/detect/blob.hpp"
#include "vision/ground_arguments.hpp"

namespace {

using namespace hal::vision;

constexpr std::int64_t most_kinds = 8;

struct Found {
    bool                           found = false;
    std::uint32_t                  crowded = 0;
    std::array<Track, most_tracks> tracks{};
};

struct Settings {
    std::array<BlobKind, most_kinds> kinds{};
    TrackRules                       track;
    std::uint32_t                    threshold = 0, area = 0;
    double                           distance = 0.0;
    bool                             operator==(const Settings& o) const noexcept {
        return kinds == o.kinds && track.gate == o.track.gate && track.gain == o.track.gain && track.forget_ns == o.track.forget_ns &&
               threshold == o.threshold && area == o.area && distance == o.distance;
    }
};

struct VisionBlob : CameraComponent<VisionBlob, Found, Settings> {
    using CameraComponent::CameraComponent;

    GroundArguments ground{*this, texts()};
    hal::Argument   kinds{*this, "kinds", 2, "kinds of things, each of one colour", {.min = 1, .max = most_kinds}};
    hal::Argument   count{*this, "tracks", 8, "things at a time", {.min = 1, .max = static_cast<std::int64_t>(most_tracks)}};

    hal::Outs<std::uint32_t> id{*this, "track-#-id", count, "number of the thing in place #, counted from 1; 0: there is none"};
    hal::Outs<std::uint32_t> kind{*this, "track-#-kind", count, "what the thing in place # is"};
    hal::Outs<double>        x{
        *this, "track-#-x", count, "where the thing in place # stands, in front of the robot's middle", {.unit = "m", .finite = true}};
    hal::Outs<double> y{*this, "track-#-y", count, "where the thing in place # stands, to the left", {.unit = "m", .finite = true}};
    hal::Outs<double> age{*this, "track-#-age", count, "time since the thing in place # was seen first", {.unit = "s", .finite = true}};
    hal::Outs<double> unseen{
        *this, "track-#-unseen", count, "time since the frame that showed it last was taken", {.unit = "s", .finite = true}};
    hal::Outs<std::uint32_t> sightings{*this, "track-#-sightings", count, "frames that showed the thing in place #"};
    hal::Out<std::uint32_t>  things{*this, "count", "things that are known"};
    hal::Out<std::uint32_t>  crowded{*this, "crowded", "sightings for which no place was left"};

    hal::Params<double> hue{*this, "kind-#-hue", kinds, "colour of kind #: 0 red, 120 green, 240 blue", {.unit = "deg"}};
    hal::Params<double> tolerance{
        *this, "kind-#-tolerance", kinds, "the colour of kind # may be off by so much", {.initial = 35.0, .unit = "deg"}};
    hal::Params<double> radius{*this, "kind-#-radius", kinds, "of kind #, on the ground", {.initial = 0.033, .unit = "m"}};

    hal::Param<std::uint32_t> threshold{*this, "threshold", "how strong a colour has to be, of 255", {.initial = 40}};
    hal::Param<std::uint32_t> least_area{*this, "least-area", "how many pixels of a thing have to be seen", {.initial = 40}};
    hal::Param<double>        most_distance{*this, "most-distance", "what is farther away is not told", {.initial = 3.0, .unit = "m"}};
    hal::Param<double>        gate{
        *this, "gate", "farther than that from where a thing was seen, it is another one", {.initial = 0.15, .unit = "m"}};
    hal::Param<double> gain{*this, "gain", "how much of the way to where it is seen a thing's place goes, 0 to 1", {.initial = 0.5}};
    hal::Param<double> forget{*this, "forget", "a thing that was not seen for so long is gone", {.initial = 1.0, .unit = "s"}};

    void detect(const Frame& frame, const Settings& of, Found& result) {
        if (frame.format != Format::bgr)
            throw std::runtime_error(
                "things are told by their colours and these frames have none; take a camera of colours, without grey in source=");
        const BlobRules rules{static_cast<int>(std::min(of.threshold, 254u)), static_cast<int>(std::clamp(of.area, 1u, 10'000'000u)),
                              of.distance};
        const auto      seen = find_blobs(frame, ground.in(frame), {of.kinds.data(), static_cast<std::size_t>(kinds)}, rules);
        tracks_.see(seen, frame.stamp_ns, of.track);
        std::copy(tracks_.all().begin(), tracks_.all().end(), result.tracks.begin());
        result.crowded = tracks_.crowded();
        result.found = true;  // no things are a finding too
    }

    Settings settings() const noexcept {
        Settings of;
        for (std::size_t i = 0; i < hue.size(); ++i) of.kinds[i] = {{finite(hue[i]), finite(tolerance[i])}, finite(radius[i])};
        of.track = {finite(gate), finite(gain), static_cast<std::int64_t>(std::clamp(finite(forget), 0.0, 1e6) * 1e9)};
        of.threshold = threshold, of.area = least_area, of.distance = finite(most_distance);
        return of;
    }

    void show(const Found& found, bool, hal::Cycle cycle) noexcept {
        std::uint32_t known = 0;
        for (std::size_t i = 0; i < id.size(); ++i) {
            const Track& track = found.tracks[i];
            id[i] = track.id, kind[i] = track.kind, sightings[i] = track.sightings;
            x[i] = finite(track.x), y[i] = finite(track.y);
            age[i] = track.id == 0 ? 0.0 : static_cast<double>(cycle.start_ns() - track.first_ns) * 1e-9;
            unseen[i] = track.id == 0 ? 0.0 : static_cast<double>(cycle.start_ns() - track.last_ns) * 1e-9;
            known += track.id != 0;
        }
        things = known;
        crowded = found.crowded;
    }

private:
    static double finite(double value) noexcept { return std::isfinite(value) ? value : 0.0; }
    Tracks        tracks_{static_cast<std::size_t>(count)};  // of the helper thread
};

}  // namespace

HAL_COMPONENT(VisionBlob, "vision_blob", "Coloured things on the ground, told apart and followed: bottles and cans", R"(
A thing is an upright cylinder of one colour; each kind has a hue and a radius. It stands where its picture ends below, half a thing
behind that on the ground. Where a pixel is on the ground follows from how the camera is mounted (`focal`, `camera_height`, `pitch`,
`forward`), or from points that were measured (`ground=`, a file as vision_homography's).

A thing keeps its place in the row of tracks, and its id, while it is seen again within `forget` and within `gate` of where it was; of two
things that could be the same the nearer is. In the meantime `track-#-unseen` grows. `valid` says that frames come and are of use, not
that there is a thing: that is `count`.

Two things of one kind that touch in the picture are one; a thing that goes beyond the lower edge of the picture is not told.

    loadrt vision_scene show=floor objects=2
    loadrt vision_blob source=sim:floor camera_height=0.3 pitch=0.6 kinds=2
    setp vision-blob.0.kind-0-hue 120
    setp vision-blob.0.kind-1-hue 0
    addf vision-scene.0.update servo
    addf vision-blob.0.update servo
    net nearest-x vision-blob.0.track-0-x
)")
