// SPDX-License-Identifier: MIT
#include <deque>
#include <stdexcept>

#include "hal/component.hpp"
#include "vision/scene/stage.hpp"

namespace {

using namespace hal::vision::scene;

class VisionScene : public hal::Component {
public:
    explicit VisionScene(const hal_host* host)
        : Component(host),
          show_(*this, "show", "furuta", "furuta, floor or markers"),
          camera_(*this, "camera", "",
                  "name of the camera, for source=sim:NAME; default: the scene",
                  {.per_instance = true}),
          width_(*this, "width", 320, "width of a frame, px", {.min = 16, .max = 4096}),
          height_(*this, "height", 240, "height of a frame, px", {.min = 16, .max = 4096}),
          fps_(*this, "fps", 100.0, "frames per second"),
          focal_(*this, "focal", 280.0, "focal length, px"),
          seed_(*this, "seed", 1, "seed of the noise"),
          grey_(*this, "grey", 0, "1: greyscale camera", {.min = 0, .max = 1}),
          distance_(*this, "distance", 1.2,
                    "furuta: distance from the motor axis to the camera, m"),
          camera_height_(*this, "camera_height", 0.3,
                         "height of the camera above the arm (furuta) or the floor (floor), m"),
          pitch_(*this, "pitch", 0.6, "floor: downward tilt of the camera, rad"),
          objects_(*this, "objects", 0, "floor: number of bottles and cans",
                   {.min = 0, .max = static_cast<std::int64_t>(max_objects)}),
          markers_(*this, "markers", 1, "markers: number of markers",
                   {.min = 1, .max = static_cast<std::int64_t>(max_markers)}),
          settings_(settled()) {
        switch (settings_.kind) {
        case Kind::furuta: declare_furuta(); break;
        case Kind::floor: declare_floor(); break;
        case Kind::markers: declare_markers(); break;
        }
    }

    void start() {
        stage_ = std::make_shared<Stage>(settings_);
        open(name_, stage_);
        opened_ = true;
    }
    void stop() noexcept {
        if (opened_) {
            close(name_);
        }
        opened_ = false;
    }

    void update(hal::Cycle cycle) noexcept {
        if (!stage_) return;
        take(at::light, light);
        take(at::noise, noise);
        take(at::blur, blur);
        take(at::covered, covered);
        take(at::frozen, frozen ? 1.0 : 0.0);
        take(at::unplugged, unplugged ? 1.0 : 0.0);
        take(at::exposure, exposure);
        take(at::delay, delay);
        std::size_t i = first_pose();
        for (const auto& pose : poses_) {
            take(i++, pose);
        }
        stage_->put(cycle.start_ns(), values_);
    }

private:
    Settings settled() {
        Settings of;
        const std::string what = show_.get();
        if (what == "furuta") {
            of.kind = Kind::furuta;
        } else if (what == "floor") {
            of.kind = Kind::floor;
        } else if (what == "markers") {
            of.kind = Kind::markers;
        } else {
            throw hal::ArgumentError(
                "show", "show=" + what + " is not a valid scene; use furuta, floor or markers");
        }
        name_ = camera_.get().empty() ? what : camera_.get();
        of.width = static_cast<int>(width_);
        of.height = static_cast<int>(height_);
        of.fps = within("fps", fps_, 0.1, 1000.0);
        of.focal = within("focal", focal_, 1.0, 1e5);
        of.seed = static_cast<std::uint64_t>(static_cast<std::int64_t>(seed_));
        of.grey = grey_ != 0;
        of.distance = within("distance", distance_, 0.6, 100.0);
        of.camera_height =
            within("camera_height", camera_height_, of.kind == Kind::floor ? 0.01 : -5.0, 100.0);
        of.pitch = within("pitch", pitch_, 0.1, 1.5);
        of.objects = static_cast<int>(objects_);
        of.markers = static_cast<int>(markers_);
        return of;
    }
    static double within(const char* name, double value, double min, double max) {
        if (value >= min && value <= max) return value;
        throw hal::ArgumentError(name, std::string(name) + "=" + short_text(value) +
                                           " is outside " + short_text(min) + " to " +
                                           short_text(max));
    }
    static std::string short_text(double value) {
        std::string text = std::to_string(value);
        text.erase(text.find_last_not_of('0') + 1);
        if (text.back() == '.') {
            text.pop_back();
        }
        return text;
    }
    void take(std::size_t i, double value) noexcept {  // NaN changes nothing
        if (std::isfinite(value)) {
            values_[i] = value;
        }
    }
    std::size_t first_pose() const noexcept {
        return settings_.kind == Kind::markers ? at::markers : at::poses;
    }
    void pose(const std::string& name, const std::string& doc, const char* unit,
              double initial = 0.0) {
        poses_.emplace_back(*this, name.c_str(), doc.c_str(),
                            hal::PinOptions<double>{.initial = initial, .unit = unit});
    }
    void declare_furuta() {
        pose("arm-angle", "arm angle; 0 towards the camera", "rad");
        pose("pendulum-angle", "pendulum angle; 0 hanging down", "rad");
    }
    void declare_floor() {
        pose("x", "where the robot with the camera is", "m");
        pose("y", "where the robot with the camera is", "m");
        pose("heading", "heading of the robot; 0 along x, positive to the left", "rad");
        pose("line-width", "width of the line on the floor; 0: no line", "m", 0.02);
        pose("line-amplitude", "the line is y = amplitude sin(2 pi x / length)", "m");
        pose("line-length", "see line-amplitude", "m", 2.0);
        pose("line-dark", "1: a dark line on a light floor; 0: a light one on a dark floor", "",
             1.0);
        pose("line-gap", "length of the gap in the line in each half metre", "m");
        for (int i = 0; i < settings_.objects; ++i) {
            const std::string name = "object-" + std::to_string(i);
            pose(name + "-kind", "0: none, 1: bottle, 2: can", "");
            pose(name + "-x", "where it stands", "m");
            pose(name + "-y", "where it stands", "m");
        }
    }
    void declare_markers() {
        for (int i = 0; i < settings_.markers; ++i) {
            const std::string name = "marker-" + std::to_string(i);
            pose(name + "-id", "id in the dictionary 4x4_50; below 0: none", "",
                 i == 0 ? 0.0 : -1.0);
            pose(name + "-size", "side length of the black square", "m", 0.05);
            pose(name + "-x", "centre, to the right in camera view", "m");
            pose(name + "-y", "centre, downwards in camera view", "m");
            pose(name + "-z", "centre, distance from the camera", "m", 0.5);
            pose(name + "-roll", "rotation about the camera's x axis; pi: faces the camera", "rad",
                 3.14159265358979312);
            pose(name + "-pitch", "rotation about the camera's y axis, after roll", "rad");
            pose(name + "-yaw", "rotation about the camera's z axis, after pitch", "rad");
        }
    }

    hal::TextArgument show_, camera_;
    hal::Argument width_, height_;
    hal::RealArgument fps_, focal_;
    hal::Argument seed_, grey_;
    hal::RealArgument distance_, camera_height_, pitch_;
    hal::Argument objects_, markers_;
    std::string name_;
    Settings settings_;

    std::deque<hal::In<double>> poses_;
    std::array<double, max_values> values_{};
    std::shared_ptr<Stage> stage_;
    bool opened_ = false;

public:
    hal::In<double> light{*this, "light", "brightness; 1: nominal, 0: dark", {.initial = 1.0}};
    hal::In<double> noise{*this,
                          "noise",
                          "standard deviation of the sensor noise, of 255; without noise, a static "
                          "scene is detected as a frozen camera",
                          {.initial = 3.0}};
    hal::In<double> blur{
        *this, "blur", "standard deviation of the lens's blur", {.initial = 0.6, .unit = "px"}};
    hal::In<double> covered{*this, "covered", "covered part of the frame, from the left; 1: all"};
    hal::In<bool> frozen{*this, "frozen", "TRUE: the camera repeats the same frame"};
    hal::In<bool> unplugged{*this, "unplugged", "TRUE: the camera is unplugged"};
    hal::In<double> exposure{*this,
                             "exposure",
                             "exposure time, which causes motion blur",
                             {.initial = 0.002, .unit = "s"}};
    hal::In<double> delay{*this,
                          "delay",
                          "latency from the end of the exposure to the arrival of the frame",
                          {.initial = 0.01, .unit = "s"}};
    hal::Function run{*this, "update", &VisionScene::update, "updates the scene"};
};

}  // namespace

HAL_COMPONENT(
    VisionScene, "vision_scene",
    "Simulated camera: a Furuta pendulum, a floor with bottles, cans and a line, or markers", R"(
Simulates a camera and its scene. Link the pins to the plant of the netlist; the vision components
read the frames with `source=sim:NAME`, where NAME is `camera=`, or by default `show=`. Frames are a
function of the runtime's clock and of `seed`: on the virtual clock the same netlist renders the
same frames.

A frame is due every 1/fps s. It is the mean of the scene during `exposure`, its timestamp is the
middle of the exposure, and it arrives `delay` after the end of the exposure.

**furuta.** The camera stands `distance` from the motor's axis, `camera_height` above the arm, and
looks at where they meet. The arm is 0.2 m long, the pendulum 0.3 m; a red ball marks the pendulum's
pivot and a green one its end.

**floor.** The camera is above the robot's middle, `camera_height` above the floor, and looks
forward and down by `pitch`. Bottles are green, 60 mm in diameter and 200 mm high; cans are red, 66
mm and 115 mm.

**markers.** ArUco markers of the dictionary 4x4_50 with a white border; their poses are seen from
the camera: x to the right, y down, z away; the rotation is yaw after pitch after roll, each about
an axis of the camera.

    loadrt vision_scene show=furuta fps=100
    addf vision-scene.0.update servo
    setp vision-scene.0.noise 3
    net arm => vision-scene.0.arm-angle
)")
