// SPDX-License-Identifier: MIT
#include <cmath>

#include "vision/camera_component.hpp"
#include "vision/camera_file.hpp"
#include "vision/detect/marker.hpp"

namespace {

using namespace hal::vision;

struct Found {
    bool found = false;
    std::int32_t id = -1;
    std::uint32_t count = 0;
    double u = 0;
    double v = 0;
    double error_px = 0;
    double ambiguity = 0;
    Pose pose;
};

struct Settings {
    std::int32_t id = -1;
    double size_mm = 0;
    double max_error_px = 0;
    bool operator==(const Settings&) const = default;
};

class VisionMarker : public CameraComponent<VisionMarker, Found, Settings> {
public:
    explicit VisionMarker(const hal_host* host) : CameraComponent(host) {
        std::optional<Camera> camera;
        has_pose_ = !camera_.get().empty();
        if (has_pose_) {
            camera = camera_from(texts(), camera_.get());
            expect(camera->width, camera->height, camera->file);
        }
        detector_.emplace(dictionary_.get(), std::move(camera));
    }

    void detect(const Frame& frame, const Settings& of, Found& found) {
        const std::vector<Marker> markers = detector_->find(frame, of.id, of.size_mm);
        const Marker* best = nullptr;
        for (const Marker& marker : markers) {
            if (!best && (of.max_error_px <= 0.0 || marker.error_px <= of.max_error_px)) {
                best = &marker;
            }
        }
        found.count = static_cast<std::uint32_t>(markers.size());
        if (!best || (has_pose_ && !is_size(of.size_mm))) return;
        found.found = true;
        found.id = best->id;
        found.pose = best->pose;
        found.error_px = best->error_px;
        found.ambiguity = best->ambiguity;
        for (const auto& corner : best->corners) {
            found.u += corner[0] / 4;
            found.v += corner[1] / 4;
        }
    }
    Settings settings() const noexcept { return {wanted, size, max_error}; }
    void show(const Found& f, bool fresh, hal::Cycle) noexcept {
        if (!fresh) return;
        count = f.count;
        if (!f.found) return;
        id = f.id;
        x = f.pose.x_mm;
        y = f.pose.y_mm;
        z = f.pose.z_mm;
        roll = f.pose.roll_deg;
        pitch = f.pose.pitch_deg;
        yaw = f.pose.yaw_deg;
        u = f.u;
        v = f.v;
        error = f.error_px;
        ambiguity = f.ambiguity;
    }

    hal::In<std::int32_t> wanted{*this,
                                 "target-id",
                                 "id of the marker to detect; -1: the lowest id in the frame",
                                 {.initial = -1}};
    hal::In<double> size{
        *this,
        "size",
        "side length of the marker's black square; not above 0, NaN or infinite: valid is FALSE",
        {.initial = 50.0, .unit = "mm"}};
    hal::Param<double> max_error{*this,
                                 "max-error",
                                 "maximum error of a valid marker; 0: no limit",
                                 {.initial = 2.0, .unit = "px"}};
    hal::Out<std::int32_t> id{*this, "id", "id of the detected marker", {.initial = -1}};
    hal::Out<std::uint32_t> count{*this, "count", "number of matching markers in the frame"};
    hal::Out<double> x{*this, "x", "position to the right of the camera", {.unit = "mm"}};
    hal::Out<double> y{*this, "y", "position below the camera", {.unit = "mm"}};
    hal::Out<double> z{*this, "z", "distance in front of the camera", {.unit = "mm"}};
    hal::Out<double> roll{
        *this, "roll", "rotation about the camera's x axis, applied first", {.unit = "deg"}};
    hal::Out<double> pitch{
        *this, "pitch", "rotation about the y axis, applied second", {.unit = "deg"}};
    hal::Out<double> yaw{*this, "yaw", "rotation about the z axis, applied third", {.unit = "deg"}};
    hal::Out<double> u{
        *this, "u", "centre of the marker in the frame, from the left", {.unit = "px"}};
    hal::Out<double> v{
        *this, "v", "centre of the marker in the frame, from the top", {.unit = "px"}};
    hal::Out<double> error{
        *this, "error", "reprojection error of the corners, root mean square", {.unit = "px"}};
    hal::Out<double> ambiguity{*this, "ambiguity",
                               "ratio of the errors of this pose and its mirror image over the "
                               "last frames: 0 unambiguous, 1 ambiguous"};

private:
    static bool is_size(double mm) noexcept { return std::isfinite(mm) && mm > 0.0; }

    hal::TextArgument dictionary_{
        *this, "dictionary", "4x4_50",
        "marker dictionary: 4x4_50, 5x5_100, 6x6_250, apriltag_36h11 ..."};
    hal::TextArgument camera_{
        *this,
        "camera",
        "",
        "file with the camera's calibration, relative to the netlist; required for the pose",
        {.per_instance = true}};
    std::optional<MarkerDetector> detector_;  // of the helper thread, once started
    bool has_pose_ = false;                   // a camera is given
};

}  // namespace

HAL_COMPONENT(VisionMarker, "vision_marker",
              "Detects a square marker and its pose relative to the camera", R"(
Detects ArUco markers in the frames of `source=` and computes the pose of one of them: `x` to the
right, `y` down, `z` in front of the camera in mm; the rotation from the marker (x right, y up, z
out of its face) to the camera is R = Rz(yaw) Ry(pitch) Rx(roll) in degrees. An upright marker that
faces the camera has roll 180.

The pose requires a file with the camera's calibration, `camera=`:

    size 640 480
    focal 600 600
    centre 319.5 239.5
    distortion 0.05 -0.12 0 0 0     # k1 k2 p1 p2 k3

or the YAML file of OpenCV's calibration, and `size`, the side length of the black square. Without a
calibration only `id`, `u` and `v` are available.

**Ambiguity.** The image of a small, distant or nearly frontal square matches two poses almost
equally well: the correct one and its mirror image about the line of sight, with the same position
and a different tilt (T. Collins and A. Bartoli, 2014). Both are tracked from frame to frame, and
the pins have the one with the smaller error over the last frames (each frame has 0.8 times the
weight of the next). `ambiguity` is the ratio of the two errors. A controller that uses the tilt
should compare it with a limit, for example 0.7; `x`, `y`, `z` and `yaw` hardly depend on it.

A separate thread processes the newest frame; `update` copies the last result to the pins.
Controllers should use `valid`: it is TRUE if the newest processed frame contains the marker and is
not older than `max-age-ms`. While it is FALSE the pins keep their last values. If the camera is
unplugged, covered or hangs, a message is printed, `valid` becomes FALSE, and operation resumes
automatically with valid frames. Several components may use the same camera, all with the same
options.

    loadrt threads name1=servo period1=1000000
    loadrt vision_marker names=dock source=v4l2:/dev/video0?width=640&height=480
    addf dock.update servo
    setp dock.target-id 7
    setp dock.size 80
)")
