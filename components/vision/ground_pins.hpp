// SPDX-License-Identifier: MIT
// Where the ground is, for components that look at it: load arguments for a camera on a mast, or a homography by pins.
#pragma once

#include "hal/component.hpp"
#include "vision/capture/frame.hpp"
#include "vision/detect/ground.hpp"

namespace hal::vision {

class GroundPins {
public:
    explicit GroundPins(hal::Component& component)
        : focal_(component, "focal", 280.0, "focal length of the camera, px"),
          height_(component, "camera_height", 0.3, "of the camera above the ground, m"),
          pitch_(component, "pitch", 0.6, "how far the camera looks down, rad"),
          forward_(component, "forward", 0.0, "how far the camera is in front of the robot's middle, m"),
          h_(component, "h-#", 9, "homography from the picture to the ground, element # row by row; all 0: the load arguments say it") {
        if (!(focal_ > 0.0 && height_ > 0.0 && pitch_ > 0.0 && pitch_ < 1.6))
            throw std::invalid_argument(
                "focal and camera_height have to be above 0, and pitch between 0 and 1.6 rad: the camera looks down");
    }
    /// The homography of the pins. [realtime]
    Ground linked() const noexcept {
        Ground to;
        for (std::size_t i = 0; i < to.h.size(); ++i) to.h[i] = std::isfinite(h_[i].get()) ? h_[i].get() : 0.0;
        return to;
    }
    /// That one, or the one of the load arguments when it is 0. [any]
    Ground of(const Frame& frame, const Ground& linked) const noexcept {
        if (!(linked == Ground{})) return linked;
        return mounted(focal_, 0.5 * (frame.width - 1), 0.5 * (frame.height - 1), height_, pitch_, forward_);
    }

private:
    hal::RealArgument focal_, height_, pitch_, forward_;
    hal::Ins<double>  h_;
};

}  // namespace hal::vision
