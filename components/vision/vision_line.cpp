// SPDX-License-Identifier: MIT
#include "vision/camera_component.hpp"
#include "vision/detect/line.hpp"
#include "vision/ground_arguments.hpp"

namespace {

using namespace hal::vision;

struct Found {
    bool found = false;
    double offset = 0.0;
    double heading = 0.0;
    double curvature = 0.0;
    double quality = 0.0;
};

struct Settings {
    double width = 0.0;
    double ahead = 0.0;
    double reach = 0.0;
    double contrast = 0.0;
    double quality = 0.0;
    std::uint32_t bands = 0;
    bool light = false;
    bool operator==(const Settings&) const = default;
};

struct VisionLine : CameraComponent<VisionLine, Found, Settings> {
    using CameraComponent::CameraComponent;

    GroundArguments ground{*this, texts()};

    hal::Out<double> offset{
        *this,
        "offset",
        "offset of the line from the robot's centre, at the distance ahead; positive to the left",
        {.unit = "m", .finite = true}};
    hal::Out<double> heading{
        *this,
        "heading",
        "heading of the line there, relative to the robot; positive to the left",
        {.unit = "rad", .finite = true}};
    hal::Out<double> curvature{*this,
                               "curvature",
                               "curvature of the line there; positive to the left",
                               {.unit = "1/m", .finite = true}};
    hal::Out<double> quality{*this,
                             "quality",
                             "fraction of the bands of the newest frame that agree with the line",
                             {.finite = true}};
    hal::Out<bool> fresh_out{*this, "new", "TRUE in the cycle with a new result"};
    hal::Out<std::uint32_t> missed{*this, "missed", "number of frames without a line"};

    hal::Param<bool> light{*this, "light-line",
                           "TRUE: the line is lighter than the floor; FALSE: darker"};
    hal::Param<double> width{*this,
                             "width",
                             "width of the line; candidates narrower than half or wider than twice "
                             "this width are rejected",
                             {.initial = 0.02, .unit = "m"}};
    hal::Param<double> ahead{*this,
                             "ahead",
                             "distance ahead of the robot's centre for offset and heading",
                             {.initial = 0.3, .unit = "m"}};
    hal::Param<double> reach{*this,
                             "reach",
                             "maximum distance of the evaluated part of the image",
                             {.initial = 0.6, .unit = "m"}};
    hal::Param<double> contrast{
        *this, "contrast", "minimum difference from the floor, 0..255", {.initial = 20.0}};
    hal::Param<double> min_quality{
        *this, "min-quality", "minimum quality of a valid line", {.initial = 0.4}};
    hal::Param<std::uint32_t> bands{
        *this, "bands", "number of horizontal bands to evaluate, 3..32", {.initial = 12}};

    void detect(const Frame& frame, const Settings& of, Found& result) {
        LineRules rules;
        rules.dark = !of.light;
        rules.width = of.width;
        rules.ahead = of.ahead;
        rules.reach = of.reach;

        rules.contrast = of.contrast;
        rules.min_quality = of.quality;
        rules.bands = static_cast<int>(std::clamp(of.bands, 3u, 32u));
        const LineSeen seen = find_line(frame, ground.in(frame), rules);
        result = {seen.found, seen.offset, seen.heading, seen.curvature, seen.quality};
    }

    Settings settings() const noexcept {
        return {std::isfinite(width) ? std::fmax(width, 1e-4) : 0.02,
                finite(ahead),
                finite(reach),
                finite(contrast),
                finite(min_quality),
                bands,
                light};
    }

    void show(const Found& found, bool fresh, hal::Cycle) noexcept {
        fresh_out = fresh && found.found && valid;
        if (!fresh) return;
        quality = finite(found.quality);
        if (found.found) {
            offset = found.offset;
            heading = found.heading;
            curvature = found.curvature;
        } else {
            missed = missed + 1;
        }
    }

private:
    static double finite(double value) noexcept { return std::isfinite(value) ? value : 0.0; }
};

}  // namespace

HAL_COMPONENT(VisionLine, "vision_line", "Detects a line on the floor for a line-following robot",
              R"(
The image is divided into `bands`. In each band, areas that differ from the floor by `contrast` and
are about as wide as the line are candidates; the line is the parabola on the ground that most bands
agree with. `offset`, `heading` and `curvature` are those of the parabola `ahead` of the robot's
centre. Gaps, shadows and objects beside the line are bands that disagree; if fewer than
`min-quality` agree, `valid` is FALSE.

The mapping from pixels to the ground follows from the mounting of the camera (`focal`,
`camera_height`, `pitch`, `forward`), or from measured points (`ground=`, a file as for
vision_homography). A robot with the turning speed k1 offset + k2 heading follows the line.

    loadrt vision_scene show=floor
    loadrt vision_line source=sim:floor camera_height=0.3 pitch=0.6
    addf vision-scene.0.update servo
    addf vision-line.0.update servo
    net off-line vision-line.0.offset
)")
