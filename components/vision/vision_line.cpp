// SPDX-License-Identifier: MIT
#include "vision/camera_component.hpp"
#include "vision/detect/line.hpp"
#include "vision/ground_arguments.hpp"

namespace {

using namespace hal::vision;

struct Found {
    bool   found = false;
    double offset = 0.0, heading = 0.0, curvature = 0.0, quality = 0.0;
};

struct Settings {
    double        width = 0.0, ahead = 0.0, reach = 0.0, contrast = 0.0, quality = 0.0;
    std::uint32_t bands = 0;
    bool          light = false;
    bool          operator==(const Settings&) const = default;
};

struct VisionLine : CameraComponent<VisionLine, Found, Settings> {
    using CameraComponent::CameraComponent;

    GroundArguments ground{*this, texts()};

    hal::Out<double> offset{
        *this, "offset", "of the line from the robot's middle, `ahead` of it; positive: to the left", {.unit = "m", .finite = true}};
    hal::Out<double> heading{
        *this, "heading", "of the line there, seen from the robot; positive: it leads to the left", {.unit = "rad", .finite = true}};
    hal::Out<double> curvature{*this, "curvature", "of the line there; positive: it bends to the left", {.unit = "1/m", .finite = true}};
    hal::Out<double> quality{*this, "quality", "part of the bands of the newest frame that agree on it", {.finite = true}};
    hal::Out<bool>   fresh_out{*this, "new", "TRUE in the cycle in which there are new values, and only then"};
    hal::Out<std::uint32_t> missed{*this, "missed", "frames without a line"};

    hal::Param<bool>   light{*this, "light-line", "TRUE: the line is lighter than the floor; FALSE: darker"};
    hal::Param<double> width{*this, "width", "of the line; what is half or twice as wide is none", {.initial = 0.02, .unit = "m"}};
    hal::Param<double> ahead{
        *this, "ahead", "how far in front of the robot's middle offset and heading are told", {.initial = 0.3, .unit = "m"}};
    hal::Param<double>        reach{*this, "reach", "what is farther away is not looked at", {.initial = 0.6, .unit = "m"}};
    hal::Param<double>        contrast{*this, "contrast", "least difference from the floor, of 255", {.initial = 20.0}};
    hal::Param<double>        least_quality{*this, "least-quality", "with less it is not found", {.initial = 0.4}};
    hal::Param<std::uint32_t> bands{*this, "bands", "strips of the picture that are looked at, 3 to 32", {.initial = 12}};

    void detect(const Frame& frame, const Settings& of, Found& result) {
        LineRules rules;
        rules.dark = !of.light;
        rules.width = of.width, rules.ahead = of.ahead, rules.reach = of.reach, rules.contrast = of.contrast,
        rules.least_quality = of.quality;
        rules.bands = static_cast<int>(std::clamp(of.bands, 3u, 32u));
        const LineSeen seen = find_line(frame, ground.in(frame), rules);
        result = {seen.found, seen.offset, seen.heading, seen.curvature, seen.quality};
    }

    Settings settings() const noexcept {
        return {std::isfinite(width) ? std::fmax(width, 1e-4) : 0.02,
                finite(ahead),
                finite(reach),
                finite(contrast),
                finite(least_quality),
                bands,
                light};
    }

    void show(const Found& found, bool fresh, hal::Cycle) noexcept {
        fresh_out = fresh && found.found && valid;
        if (!fresh) return;
        quality = finite(found.quality);
        if (found.found) offset = found.offset, heading = found.heading, curvature = found.curvature;
        else missed = missed + 1;
    }

private:
    static double finite(double value) noexcept { return std::isfinite(value) ? value : 0.0; }
};

}  // namespace

HAL_COMPONENT(VisionLine, "vision_line", "A line on the floor, for a robot that follows it", R"(
The picture is cut into `bands`. In each, what stands out from the floor by `contrast` and is about as wide as the line may be the line;
the parabola on the ground that most bands agree on is it. `offset`, `heading` and `curvature` are those of the parabola `ahead` of the
robot's middle. Gaps, shadows and things beside the line are bands that do not agree; below `least-quality` of them that do, `valid` falls.

Where a pixel is on the ground follows from how the camera is mounted (`focal`, `camera_height`, `pitch`, `forward`), or from points
that were measured (`ground=`, a file as vision_homography's). A robot that turns with angular speed = k1 offset + k2 heading follows the line.

    loadrt vision_scene show=floor
    loadrt vision_line source=sim:floor camera_height=0.3 pitch=0.6
    addf vision-scene.0.update servo
    addf vision-line.0.update servo
    net off-line vision-line.0.offset
)")
