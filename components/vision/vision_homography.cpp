// SPDX-License-Identifier: MIT
#include <algorithm>

#include "vision/camera_file.hpp"
#include "vision/detect/homography.hpp"

namespace {

using namespace hal::vision;

class VisionHomography : public hal::Component {
public:
    explicit VisionHomography(const hal_host* host) : Component(host), ground_(read()) { error = ground_.error(); }

    void update(hal::Cycle) noexcept {
        for (std::size_t i = 0; i < u.size(); ++i) {
            double     at_x = x[i], at_y = y[i];
            const bool seen = ground_.map(u[i], v[i], at_x, at_y);
            x[i] = at_x;
            y[i] = at_y;
            valid[i] = seen && enable[i];
        }
    }

private:
    Ground read() {
        const hal::Texts      texts(*this);
        std::optional<Camera> camera;
        if (!camera_.get().empty()) camera = camera_from(texts, camera_.get());
        const std::string &file = file_.get(), &points = points_.get();
        if (!file.empty() && !points.empty())
            throw hal::ArgumentError("file", "file= and points= are both given; one of them says where the ground is");
        // a bare loadrt: a ground of a millimetre per pixel, so that the component can be looked at
        const std::string text = !file.empty()    ? texts.read("file", file)
                                 : points.empty() ? "0 0 0 0; 1 0 1 0; 1 1 1 1; 0 1 0 1"
                                                  : points;
        GroundText        read = read_ground(text);
        Ground            ground(read, camera);
        if (!read.problems.empty() && file.empty())
            throw hal::ArgumentError("points", "points=" + points + ": " + read.problems.front().sentence + "; " + read.problems.front().help);
        refuse(texts, file, text, "camera-text", read.problems);
        return ground;
    }

    hal::TextArgument points_{*this, "points", "",
                              "u,v:x,y of four points or more, with ; between them: pixel from the left, from the top, place in mm"};
    hal::TextArgument file_{*this, "file", "", "the same in a file beside the netlist, a line for each: u v x y"};
    hal::TextArgument camera_{*this, "camera", "", "calibration of the camera, a file beside the netlist, if its lens distorts"};
    hal::Argument     channels_{*this, "channels", 1, "how many pixels are turned into places", {.min = 1, .max = 64}};
    Ground            ground_;

public:
    hal::Ins<double>  u{*this, "u-#", channels_, "a pixel, from the left", {.unit = "px"}};
    hal::Ins<double>  v{*this, "v-#", channels_, "the same pixel, from the top", {.unit = "px"}};
    hal::Ins<bool>    enable{*this, "enable-#", channels_, "this pixel is one: link it to valid of what finds it", {.initial = true}};
    hal::Outs<double> x{*this, "x-#", channels_, "the place on the ground that is seen there", {.unit = "mm"}};
    hal::Outs<double> y{*this, "y-#", channels_, "the same", {.unit = "mm"}};
    hal::Outs<bool>   valid{*this,
                          "valid-#",
                          channels_,
                          "it is enabled and shows the ground, not the horizon or what is above it; else x and y stay",
                            {.safe = false}};
    hal::Out<double>  error{*this, "error", "how far the points of the calibration are from where they should be", {.unit = "mm"}};
    hal::Function     run{*this, "update", &VisionHomography::update, "turns pixels into places"};
};

}  // namespace

HAL_COMPONENT(VisionHomography, "vision_homography", "Pixels to places on the ground, from four points", R"(
A camera that looks at a table or a floor sees each place of it at one pixel. Four points of which both are known give the way from one
to the other, a homography; with more of them the errors even out, and `error` says what is left of them. Lay four marks on the ground, as far
apart as the camera sees, measure where they lie, and read their pixels off vision_marker's `u` and `v`.

`channels=` pixels, `u-N` and `v-N`, become places, `x-N` and `y-N`. `valid-N` is FALSE when the pixel shows no ground (it is at the horizon
or above), is no number, or `enable-N` is FALSE; then the place stays. It holds for what lies on the ground: the top of a can is
seen where the ground behind it is.

A lens that distorts bends straight lines. Give its calibration, `camera=` (see vision_marker).

    loadrt vision_homography names=table channels=2 points="102,388:0,0;541,380:600,0;455,120:600,400;188,124:0,400"
    addf table.update servo
    setp table.u-0 320
    setp table.v-0 240
)")
