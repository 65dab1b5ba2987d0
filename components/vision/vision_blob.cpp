// SPDX-License-Identifier: MIT
#include <array>

#include "vision/camera_component.hpp"
#include "vision/detect/blob.hpp"
#include "vision/ground_arguments.hpp"

namespace {

using namespace hal::vision;

constexpr std::int64_t max_kinds = 8;

struct Found {
    bool found = false;
    std::uint32_t crowded = 0;
    std::array<Track, max_tracks> tracks{};
};

struct Settings {
    std::array<BlobKind, max_kinds> kinds{};
    TrackRules track;
    std::uint32_t threshold = 0;
    std::uint32_t area = 0;
    double distance = 0.0;
    bool operator==(const Settings& o) const noexcept {
        return kinds == o.kinds && track.gate == o.track.gate && track.gain == o.track.gain &&
               track.forget_ns == o.track.forget_ns && threshold == o.threshold && area == o.area &&
               distance == o.distance;
    }
};

struct VisionBlob : CameraComponent<VisionBlob, Found, Settings> {
    using CameraComponent::CameraComponent;

    GroundArguments ground{*this, texts()};
    hal::Argument kinds{*this,
                        "kinds",
                        2,
                        "number of object kinds, each of one colour",
                        {.min = 1, .max = max_kinds}};
    hal::Argument count{*this,
                        "tracks",
                        8,
                        "maximum number of tracked objects",
                        {.min = 1, .max = static_cast<std::int64_t>(max_tracks)}};

    hal::Outs<std::uint32_t> id{*this, "track-#-id", count,
                                "id of the object in track #, from 1; 0: no object"};
    hal::Outs<std::uint32_t> kind{*this, "track-#-kind", count, "kind of the object in track #"};
    hal::Outs<double> x{*this,
                        "track-#-x",
                        count,
                        "position of the object in track #, forward of the robot's centre",
                        {.unit = "m", .finite = true}};
    hal::Outs<double> y{*this,
                        "track-#-y",
                        count,
                        "position of the object in track #, to the left",
                        {.unit = "m", .finite = true}};
    hal::Outs<double> age{*this,
                          "track-#-age",
                          count,
                          "time since the first detection of the object in track #",
                          {.unit = "s", .finite = true}};
    hal::Outs<double> unseen{*this,
                             "track-#-unseen",
                             count,
                             "time since the last frame with the object in track #",
                             {.unit = "s", .finite = true}};
    hal::Outs<std::uint32_t> sightings{*this, "track-#-sightings", count,
                                       "number of frames with the object in track #"};
    hal::Out<std::uint32_t> things{*this, "count", "number of tracked objects"};
    hal::Out<std::uint32_t> crowded{*this, "overflows",
                                    "number of detections without a free track"};

    hal::Params<double> hue{
        *this, "kind-#-hue", kinds, "hue of kind #: 0 red, 120 green, 240 blue", {.unit = "deg"}};
    hal::Params<double> tolerance{*this,
                                  "kind-#-tolerance",
                                  kinds,
                                  "tolerance of the hue of kind #",
                                  {.initial = 35.0, .unit = "deg"}};
    hal::Params<double> radius{*this,
                               "kind-#-radius",
                               kinds,
                               "radius of kind # on the ground",
                               {.initial = 0.033, .unit = "m"}};

    hal::Param<std::uint32_t> threshold{
        *this, "threshold", "minimum strength of the colour, 0..255", {.initial = 40}};
    hal::Param<std::uint32_t> min_area{
        *this, "min-area", "minimum area of an object in pixels", {.initial = 40}};
    hal::Param<double> max_distance{
        *this, "max-distance", "maximum distance of objects", {.initial = 3.0, .unit = "m"}};
    hal::Param<double> gate{*this,
                            "gate",
                            "maximum distance between two detections of the same object",
                            {.initial = 0.15, .unit = "m"}};
    hal::Param<double> gain{*this,
                            "gain",
                            "weight of a new detection in the position of a track, 0..1",
                            {.initial = 0.5}};
    hal::Param<double> forget{*this,
                              "forget",
                              "time without detection after which a track ends",
                              {.initial = 1.0, .unit = "s"}};

    void detect(const Frame& frame, const Settings& of, Found& result) {
        if (frame.format != Format::bgr) {
            throw std::runtime_error(
                "frames are greyscale, but objects are detected by colour; use a colour camera, "
                "without grey in source=");
        }
        const BlobRules rules{static_cast<int>(std::min(of.threshold, 254u)),
                              static_cast<int>(std::clamp(of.area, 1u, 10'000'000u)), of.distance};
        const auto seen = find_blobs(frame, ground.in(frame),
                                     {of.kinds.data(), static_cast<std::size_t>(kinds)}, rules);
        tracks_.see(seen, frame.stamp_ns, of.track);
        std::copy(tracks_.all().begin(), tracks_.all().end(), result.tracks.begin());
        result.crowded = tracks_.crowded();
        result.found = true;  // no objects are a valid result, too
    }

    Settings settings() const noexcept {
        Settings of;
        for (std::size_t i = 0; i < hue.size(); ++i) {
            of.kinds[i] = {{finite(hue[i]), finite(tolerance[i])}, finite(radius[i])};
        }
        of.track = {finite(gate), finite(gain),
                    static_cast<std::int64_t>(std::clamp(finite(forget), 0.0, 1e6) * 1e9)};
        of.threshold = threshold;
        of.area = min_area;
        of.distance = finite(max_distance);
        return of;
    }

    void show(const Found& found, bool, hal::Cycle cycle) noexcept {
        std::uint32_t known = 0;
        for (std::size_t i = 0; i < id.size(); ++i) {
            const Track& track = found.tracks[i];
            id[i] = track.id;
            kind[i] = track.kind;
            sightings[i] = track.sightings;
            x[i] = finite(track.x);
            y[i] = finite(track.y);
            age[i] =
                track.id == 0 ? 0.0 : static_cast<double>(cycle.start_ns() - track.first_ns) * 1e-9;
            unseen[i] =
                track.id == 0 ? 0.0 : static_cast<double>(cycle.start_ns() - track.last_ns) * 1e-9;
            known += track.id != 0;
        }
        things = known;
        crowded = found.crowded;
    }

private:
    static double finite(double value) noexcept { return std::isfinite(value) ? value : 0.0; }
    Tracks tracks_{static_cast<std::size_t>(count)};  // of the helper thread
};

}  // namespace

HAL_COMPONENT(VisionBlob, "vision_blob",
              "Detects and tracks coloured objects on the ground, such as bottles and cans", R"(
An object is an upright cylinder of one colour; each kind has a hue and a radius. Its position is
one radius behind the lower edge of its image, on the ground. The mapping from pixels to the ground
follows from the mounting of the camera (`focal`, `camera_height`, `pitch`, `forward`), or from
measured points (`ground=`, a file as for vision_homography).

An object keeps its track and its id while it is detected again within `forget` and within `gate` of
its last position; of two candidates the nearer one is used. Without detections `track-#-unseen`
increases. `valid` is TRUE while valid frames arrive, even without objects; their number is `count`.

Two objects of one kind that touch in the image count as one; an object that crosses the lower edge
of the image is ignored.

    loadrt vision_scene show=floor objects=2
    loadrt vision_blob source=sim:floor camera_height=0.3 pitch=0.6 kinds=2
    setp vision-blob.0.kind-0-hue 120
    setp vision-blob.0.kind-1-hue 0
    addf vision-scene.0.update servo
    addf vision-blob.0.update servo
    net nearest-x vision-blob.0.track-0-x
)")
