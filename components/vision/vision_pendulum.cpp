// SPDX-License-Identifier: MIT
#include <utility>

#include "vision/camera_component.hpp"
#include "vision/detect/pendulum.hpp"

namespace {

using namespace hal::vision;

struct Found {
    bool found = false;
    double arm = 0.0;
    double pendulum = 0.0;
    double residual = 0.0;
    double pivot_u = 0.0;
    double pivot_v = 0.0;
    double tip_u = 0.0;

    double tip_v = 0.0;
};

struct Settings {
    double pivot_hue = 0.0;
    double tip_hue = 0.0;
    double tolerance = 0.0;
    double residual = 0.0;
    double sigma = 0.0;
    std::uint32_t threshold = 0;
    std::uint32_t area = 0;
    bool operator==(const Settings&) const = default;
};

struct VisionPendulum : CameraComponent<VisionPendulum, Found, Settings> {
    explicit VisionPendulum(const hal_host* host) : CameraComponent(host) {
        for (const auto& [name, value] :
             {std::pair{"focal", double{focal}}, std::pair{"arm_length", double{arm_length}},
              std::pair{"rod_length", double{rod_length}}}) {
            if (!(value > 0.0)) {
                throw hal::ArgumentError(name, std::string(name) + "= is not above 0");
            }
        }
        if (!(distance > arm_length + rod_length)) {
            throw hal::ArgumentError("distance",
                                     "distance= is not above arm_length + rod_length: the pendulum "
                                     "would hit the camera");
        }
    }

    hal::RealArgument focal{*this, "focal", 280.0, "focal length of the camera, px"};
    hal::RealArgument distance{*this, "distance", 1.2,
                               "distance from the motor axis to the camera, m"};
    hal::RealArgument height{*this, "camera_height", 0.3, "height of the camera above the arm, m"};
    hal::RealArgument arm_length{
        *this, "arm_length", 0.2,
        "distance from the motor axis to the ball at the pendulum's pivot, m"};
    hal::RealArgument rod_length{
        *this, "rod_length", 0.3,
        "distance from the pivot's ball to the ball at the pendulum's end, m"};

    hal::Out<double> pendulum{*this,
                              "pendulum-angle",
                              "pendulum angle in the newest valid frame; 0 hanging down, -pi..pi",
                              {.unit = "rad", .finite = true}};
    hal::Out<double> arm{*this,
                         "arm-angle",
                         "arm angle in that frame; 0 towards the camera, -pi..pi",
                         {.unit = "rad", .finite = true}};
    hal::Out<bool> fresh_out{*this, "new", "TRUE in the cycle with new angles"};
    hal::Out<double> age{*this,
                         "age",
                         "age of the angles; link it to the age of an ekf measurement",
                         {.unit = "s", .finite = true}};
    hal::Out<double> residual{*this,
                              "residual",
                              "distance of the balls from their positions for these angles",
                              {.unit = "px", .finite = true}};
    hal::Out<double> pivot_u{*this, "pivot-u", "ball at the pivot, from the left", {.unit = "px"}};
    hal::Out<double> pivot_v{*this, "pivot-v", "ball at the pivot, from the top", {.unit = "px"}};
    hal::Out<double> tip_u{*this, "tip-u", "ball at the end, from the left", {.unit = "px"}};
    hal::Out<double> tip_v{*this, "tip-v", "ball at the end, from the top", {.unit = "px"}};
    hal::Out<std::uint32_t> missed{*this, "missed",
                                   "frames that did not show it, or not so that the angles fit"};

    hal::Param<double> pivot_hue{*this,
                                 "pivot-hue",
                                 "colour of the ball at the pivot: 0 red, 120 green, 240 blue",
                                 {.initial = 0.0, .unit = "deg"}};
    hal::Param<double> tip_hue{
        *this, "tip-hue", "colour of the ball at the end", {.initial = 120.0, .unit = "deg"}};
    hal::Param<double> tolerance{
        *this, "hue-tolerance", "a colour may be off by so much", {.initial = 40.0, .unit = "deg"}};
    hal::Param<std::uint32_t> threshold{
        *this, "threshold", "how strong a ball's colour has to be, of 255", {.initial = 30}};
    hal::Param<std::uint32_t> min_area{
        *this, "min-area", "minimum area of a ball in pixels", {.initial = 12}};
    hal::Param<double> lost_time{
        *this,
        "lost-time",
        "time without the pendulum after which a fault is raised; 0: never",
        {.initial = 0.25, .unit = "s"}};
    hal::Param<double> max_residual{*this,
                                    "most-residual",
                                    "a frame with a greater residual does not count",
                                    {.initial = 1.5, .unit = "px"}};
    hal::Param<double> max_sigma{
        *this,
        "max-sigma",
        "maximum uncertainty of an angle, assuming 0.05 px for the balls; other frames are ignored",
        {.initial = 0.005, .unit = "rad"}};

    void start() {
        record_ = hal::extension<hal_faults>("hal.faults/1");
        shown_ns_ = no_time;
        lost_ = false;
        CameraComponent::start();
    }

    void detect(const Frame& frame, const Settings& of, Found& result) {
        if (frame.format != Format::bgr) {
            throw std::runtime_error(
                "frames are greyscale, but the balls are detected by colour; use a colour camera, "
                "without grey in source=");
        }
        PendulumView view;
        PendulumLimits limits;
        view.focal_u = view.focal_v = focal;
        view.middle_u = 0.5 * (frame.width - 1);
        view.middle_v = 0.5 * (frame.height - 1);
        view.distance = distance;
        view.height = height;
        view.arm_length = arm_length;

        view.rod_length = rod_length;
        limits.pivot = {of.pivot_hue, of.tolerance};
        limits.tip = {of.tip_hue, of.tolerance};
        limits.threshold = static_cast<int>(std::min(of.threshold, 254u));

        limits.min_area = static_cast<int>(std::clamp(of.area, 1u, 1000000u));
        limits.max_residual = of.residual;
        limits.max_sigma = of.sigma;
        const PendulumSeen seen = find_pendulum(frame, view, limits);
        result = {seen.found,        seen.arm,          seen.pendulum,   seen.residual,
                  seen.pivot_ball.u, seen.pivot_ball.v, seen.tip_ball.u, seen.tip_ball.v};
    }

    Settings settings() const noexcept {
        return {finite(pivot_hue), finite(tip_hue), finite(tolerance), finite(max_residual),
                finite(max_sigma), threshold,       min_area};
    }

    void show(const Found& found, bool fresh, hal::Cycle cycle) noexcept {
        fresh_out = fresh && found.found && valid;
        if (fresh && found.found) {
            pendulum = found.pendulum;
            arm = found.arm;
            shown_ns_ = stamp_ns;
            pivot_u = found.pivot_u;
            pivot_v = found.pivot_v;
            tip_u = found.tip_u;

            tip_v = found.tip_v;
        }
        if (fresh) {
            residual = std::isfinite(found.residual) ? found.residual : 0.0;
        }
        if (fresh && !found.found) {
            missed = missed + 1;
        }
        age = shown_ns_ == no_time ? 0.0 : static_cast<double>(cycle.start_ns() - shown_ns_) * 1e-9;
        const bool lost = shown_ns_ != no_time && lost_time > 0.0 && age > lost_time;
        if (lost && !lost_) {
            missing_.begin(record_, this, "no frame showed the pendulum for {} s; valid is FALSE",
                           age);
        } else if (!lost && lost_) {
            missing_.end(record_, this);
        }
        lost_ = lost;
    }

private:
    static double finite(double value) noexcept { return std::isfinite(value) ? value : 0.0; }

    static constexpr std::int64_t no_time = INT64_MIN;
    std::int64_t shown_ns_ = no_time;  // stamp of the newest frame that showed it
    const hal_faults* record_ = nullptr;
    hal::LastingFault missing_;
    bool lost_ = false;
};

}  // namespace

HAL_COMPONENT(VisionPendulum, "vision_pendulum", "Both angles of a Furuta pendulum from a camera",
              R"(
A red ball marks the pendulum's pivot, a green one its end (other colours: `pivot-hue`, `tip-hue`).
Their centres, weighted by colour, are accurate to a few hundredths of a pixel; the angles follow by
least squares, and `residual` is the remaining error. At 320 x 240 with noise of 3 of 255 the error
of both angles is 0.5 mrad (rms).

The camera stands in front of the rig, `distance` from the motor's axis and `camera_height` above
the arm, and looks at where axis and arm meet; the arm's zero points at it. Near an arm of 90
degrees the pendulum swings to and from the camera, and two attitudes look the same: such a frame
does not count, nor does one from which an angle follows badly (`max-sigma`). The filter has to
bridge them.

For an ekf, link `pendulum-angle`, `age` and `new` to a measurement, its `-age` and its `-new`.
`new` is TRUE in one cycle per frame; the filter compensates the latency. `valid` becomes FALSE if
the newest frame does not contain the pendulum or is older than `max-age-ms`; after `lost-time`
without it a fault is raised once, for `show fault` and the safety chain.

    loadrt vision_scene show=furuta
    loadrt vision_pendulum source=sim:furuta
    addf vision-scene.0.update servo
    addf vision-pendulum.0.update servo
    net seen-angle vision-pendulum.0.pendulum-angle
)")
