// SPDX-License-Identifier: MIT
#include "vision/camera_component.hpp"
#include "vision/camera_file.hpp"
#include "vision/detect/marker.hpp"

namespace {

using namespace hal::vision;

struct Found {
    bool          found = false;
    std::int32_t  id = -1;
    std::uint32_t count = 0;
    double        u = 0, v = 0, error_px = 0, ambiguity = 0;
    Pose          pose;
};

struct Settings {
    std::int32_t id = -1;
    double       size_mm = 0, most_error = 0;
    bool         operator==(const Settings&) const = default;
};

class VisionMarker : public CameraComponent<VisionMarker, Found, Settings> {
public:
    explicit VisionMarker(const hal_host* host) : CameraComponent(host) {
        std::optional<Camera> camera;
        if (!camera_.get().empty()) {
            camera = camera_from(texts(), camera_.get());
            expect(camera->width, camera->height, camera->file);
        }
        detector_.emplace(dictionary_.get(), std::move(camera));
    }

    void detect(const Frame& frame, const Settings& of, Found& found) {
        const std::vector<Marker> markers = detector_->find(frame, of.id, of.size_mm);
        const Marker*             best = nullptr;
        for (const Marker& marker : markers)
            if (!best && (of.most_error <= 0.0 || marker.error_px <= of.most_error)) best = &marker;
        found.count = static_cast<std::uint32_t>(markers.size());
        if (!best) return;
        found.found = true;
        found.id = best->id;
        found.pose = best->pose;
        found.error_px = best->error_px;
        found.ambiguity = best->ambiguity;
        for (const auto& corner : best->corners) found.u += corner[0] / 4, found.v += corner[1] / 4;
    }
    Settings settings() const noexcept { return {wanted, size, max_error}; }
    void     show(const Found& f, bool fresh, hal::Cycle) noexcept {
        if (!fresh) return;
        count = f.count;
        if (!f.found) return;
        id = f.id;
        x = f.pose.x_mm, y = f.pose.y_mm, z = f.pose.z_mm;
        roll = f.pose.roll_deg, pitch = f.pose.pitch_deg, yaw = f.pose.yaw_deg;
        u = f.u, v = f.v;
        error = f.error_px;
        ambiguity = f.ambiguity;
    }

    hal::In<std::int32_t> wanted{
        *this, "wanted", "only the marker with this id; -1: the one with the smallest id that is seen", {.initial = -1}};
    hal::In<double>    size{*this, "size", "length of a marker's black side", {.initial = 50.0, .unit = "mm"}};
    hal::Param<double> max_error{
        *this, "max-error", "a marker whose corners fit worse than that is not found; 0: any", {.initial = 2.0, .unit = "px"}};
    hal::Out<std::int32_t>  id{*this, "id", "of the marker the pins below are about", {.initial = -1}};
    hal::Out<std::uint32_t> count{*this, "count", "markers in the frame that are wanted"};
    hal::Out<double>        x{*this, "x", "from the camera to the right", {.unit = "mm"}};
    hal::Out<double>        y{*this, "y", "from the camera down", {.unit = "mm"}};
    hal::Out<double>        z{*this, "z", "from the camera ahead", {.unit = "mm"}};
    hal::Out<double>        roll{*this, "roll", "turn about the camera's x axis, the first of three", {.unit = "deg"}};
    hal::Out<double>        pitch{*this, "pitch", "turn about the y axis, the second", {.unit = "deg"}};
    hal::Out<double>        yaw{*this, "yaw", "turn about the z axis, the third", {.unit = "deg"}};
    hal::Out<double>        u{*this, "u", "where its middle is in the frame, from the left", {.unit = "px"}};
    hal::Out<double>        v{*this, "v", "from the top", {.unit = "px"}};
    hal::Out<double>        error{*this, "error", "distance of its corners from those of this pose, root mean square", {.unit = "px"}};
    hal::Out<double>        ambiguity{*this, "ambiguity",
                               "error of this pose over the last frames divided by that of its mirror image: 0 certain, 1 either may be right"};

private:
    hal::TextArgument dictionary_{*this, "dictionary", "4x4_50", "which markers: 4x4_50, 5x5_100, 6x6_250, apriltag_36h11 ..."};
    hal::TextArgument camera_{
        *this, "camera", "", "calibration of the camera, a file beside the netlist; without it there is no pose", {.per_instance = true}};
    std::optional<MarkerDetector> detector_;  // of the helper thread, once started
};

}  // namespace

HAL_COMPONENT(VisionMarker, "vision_marker", "Finds a square marker and its pose before the camera", R"(
Looks for ArUco markers in the frames of `source=`, and gives the pose of one of them: `x` to the right, `y` down, `z` ahead of the
camera in mm; the turn from the marker (x right, y up, z out of its face) to the camera as R = Rz(yaw) Ry(pitch) Rx(roll) in degrees. A marker that
faces the camera upright has roll 180.

For a pose it needs the camera's calibration in a file, `camera=`:

    size 640 480
    focal 600 600
    centre 319.5 239.5
    distortion 0.05 -0.12 0 0 0     # k1 k2 p1 p2 k3

or the YAML that OpenCV's calibration writes. And `size`, the length of a black side. Without a calibration there are `id`, `u` and `v`
only.

**Ambiguity.** The picture of a small, distant or nearly frontal square fits two poses nearly equally well: the right one and its mirror image
about the line of sight, with the same place and another tilt (T. Collins and A. Bartoli, 2014). Both are followed from frame to frame, and the
pins show the one with the smaller error over the last frames (each frame counts 0.8 times as much as the next). `ambiguity` is the ratio of the
two errors. A controller that uses the tilt compares it with a limit, 0.7 for example; `x`, `y`, `z` and `yaw` do not depend on it much.

The work is done in a thread of its own, of which the newest frame is the only one that counts; `update` copies the last result to the pins.
What a controller acts on is `valid`: it is TRUE when the newest frame that was looked at shows the marker and is not older than
`max-age-ms`. While it is FALSE the pins keep their last values. When the camera is unplugged, covered or hangs, one line says so, `valid` falls, and
everything goes on by itself when the frames are good again. Several components may name the same camera, all with the same options.

    loadrt threads name1=servo period1=1000000
    loadrt vision_marker names=dock source=v4l2:/dev/video0?width=640&height=480
    addf dock.update servo
    setp dock.wanted 7
    setp dock.size 80
)")
