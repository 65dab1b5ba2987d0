// SPDX-License-Identifier: MIT
// Files that components with a camera read; their errors are reported like those of the netlist.
#pragma once

#include <string>

#include "hal/component.hpp"
#include "hal/texts.hpp"
#include "vision/capture/camera.hpp"

namespace hal::vision {

/// Reads the calibration `file`, in the constructor of a component. [setup]
inline Camera camera_from(const hal::Texts& texts, const std::string& file) {
    const std::string text = texts.read("camera", file);
    CameraText read = read_camera(text);
    texts.reject(file, text, "camera-text", read.problems);
    read.camera.file = file;
    return read.camera;
}

}  // namespace hal::vision
