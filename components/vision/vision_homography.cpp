// SPDX-License-Identifier: MIT
#include <algorithm>

#include "vision/camera_file.hpp"
#include "vision/detect/homography.hpp"

namespace {

using namespace hal::vision;

class VisionHomography : public hal::Component {
public:
    explicit VisionHomography(const hal_host* host) : Component(host), ground_(read()) {
        error = ground_.error();
    }

    void update(hal::Cycle) noexcept {
        for (std::size_t i = 0; i < u.size(); ++i) {
            double at_x = x[i];
            double at_y = y[i];
            const bool seen = ground_.map(u[i], v[i], at_x, at_y);
            x[i] = at_x;
            y[i] = at_y;
            valid[i] = seen && enable[i];
        }
    }

private:
    Ground read() {
        const hal::Texts texts(*this);
        std::optional<Camera> camera;
        if (!camera_.get().empty()) {
            camera = camera_from(texts, camera_.get());
        }
        const std::string &file = file_.get(), &points = points_.get();
        if (!file.empty() && !points.empty()) {
            throw hal::ArgumentError("file", "file= and points= are both given; use one of them");
        }
        // a bare loadrt: a ground of one millimetre per pixel, so that the component can be
        // inspected
        std::string text = points.empty() ? "0 0 0 0; 1 0 1 0; 1 1 1 1; 0 1 0 1" : points;
        if (!file.empty()) {
            text = texts.read("file", file);
        }
        GroundText read = read_ground(text);
        Ground ground(read, camera);
        if (!read.problems.empty() && file.empty()) {
            throw hal::ArgumentError("points", "points=" + points + ": " +
                                                   read.problems.front().sentence + "; " +
                                                   read.problems.front().help);
        }
        texts.reject(file, text, "camera-text", read.problems);
        return ground;
    }

    hal::TextArgument points_{*this, "points", "",
                              "u,v:x,y of at least four points, separated by ;: pixel from the "
                              "left and top, position in mm"};
    hal::TextArgument file_{*this, "file", "",
                            "file with the points, relative to the netlist, one per line: u v x y"};
    hal::TextArgument camera_{
        *this, "camera", "",
        "file with the camera's calibration, relative to the netlist, for a lens with distortion"};
    hal::Argument channels_{
        *this, "channels", 1, "number of pixels to convert", {.min = 1, .max = 64}};
    Ground ground_;

public:
    hal::Ins<double> u{*this, "u-#", channels_, "pixel to convert, from the left", {.unit = "px"}};
    hal::Ins<double> v{*this, "v-#", channels_, "pixel to convert, from the top", {.unit = "px"}};
    hal::Ins<bool> enable{*this,
                          "enable-#",
                          channels_,
                          "TRUE converts the pixel; link it to valid of the detector",
                          {.initial = true}};
    hal::Outs<double> x{*this, "x-#", channels_, "position on the ground, x", {.unit = "mm"}};
    hal::Outs<double> y{*this, "y-#", channels_, "position on the ground, y", {.unit = "mm"}};
    hal::Outs<bool> valid{
        *this,
        "valid-#",
        channels_,
        "TRUE: enabled, and the pixel is below the horizon; otherwise x and y are held",
        {.safe = false}};
    hal::Out<double> error{
        *this, "error", "residual error of the calibration points", {.unit = "mm"}};
    hal::Function run{*this, "update", &VisionHomography::update, "converts pixels to positions"};
};

}  // namespace

HAL_COMPONENT(VisionHomography, "vision_homography",
              "Converts pixels to positions on the ground by a homography", R"(
A camera above a table or a floor maps each position on it to one pixel. Four points with known
pixel and position define this mapping, a homography; more points average out errors, and `error` is
the residual. Put four marks on the ground, as far apart as possible in the image, measure their
positions, and read their pixels from `u` and `v` of vision_marker.

`channels=` pixels, `u-N` and `v-N`, are converted to positions, `x-N` and `y-N`. `valid-N` is FALSE
if the pixel is at or above the horizon or NaN, or if `enable-N` is FALSE; then the position is
held. The conversion is valid for points on the ground only: the top of a can appears at the
position of the ground behind it.

For a lens with visible distortion, give its calibration, `camera=` (see vision_marker).

    loadrt vision_homography names=table channels=2 points="102,388:0,0;541,380:600,0;455,120:600,400;188,124:0,400"
    addf table.update servo
    setp table.u-0 320
    setp table.v-0 240
)")
