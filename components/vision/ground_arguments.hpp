// SPDX-License-Identifier: MIT
// The mapping from pixels to the ground: by the mounting of the camera, or by measured points.
#pragma once

#include <optional>

#include "hal/component.hpp"
#include "vision/camera_file.hpp"
#include "vision/capture/frame.hpp"
#include "vision/detect/ground.hpp"

namespace hal::vision {

class GroundArguments {
public:
    GroundArguments(hal::Component& component, const hal::Texts& texts)
        : focal_(component, "focal", 280.0, "focal length of the camera, px"),
          height_(component, "camera_height", 0.3, "height of the camera above the ground, m"),
          pitch_(component, "pitch", 0.6, "downward tilt of the camera, rad"),
          forward_(component, "forward", 0.0,
                   "distance of the camera in front of the robot's centre, m"),
          file_(component, "ground", "",
                "file beside the netlist with points of the ground, u v x y with x forward and y "
                "to the left in mm, as of "
                "vision_homography; in "
                "place of focal, camera_height, pitch and forward") {
        if (!(focal_ > 0.0)) {
            throw hal::ArgumentError(
                "focal",
                "focal= is not above 0; give it in px, usually about the width of the frame");
        }
        if (!(height_ > 0.0)) {
            throw hal::ArgumentError(
                "camera_height", "camera_height= is not above 0; give it in m above the ground");
        }
        if (!(pitch_ > 0.0 && pitch_ < 1.6)) {
            throw hal::ArgumentError("pitch",
                                     "pitch= is not above 0 and below 1.6; give it in rad, 0 is "
                                     "horizontal and positive is downwards");
        }
        if (file_.get().empty()) return;
        const std::string text = texts.read("ground", file_.get());
        GroundText read = read_ground(text);
        measured_.emplace(read, std::nullopt);
        texts.reject(file_.get(), text, "camera-text", read.problems);
    }
    /// [helper thread]
    const Ground& in(const Frame& frame) {
        if (measured_) return *measured_;
        if (frame.width != width_ || frame.height != high_) {
            mast_ = ground_before({focal_, height_, pitch_, forward_}, width_ = frame.width,
                                  high_ = frame.height);
        }
        return mast_;
    }

private:
    hal::RealArgument focal_, height_, pitch_, forward_;
    hal::TextArgument file_;
    std::optional<Ground> measured_;
    Ground mast_;                   // of the helper thread
    int width_ = 0;
    int high_ = 0;   // of the frames that mast_ is about
};

}  // namespace hal::vision
