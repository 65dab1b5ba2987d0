// SPDX-License-Identifier: MIT
// Files of a user's that cameras' components read: what is wrong in them is said as the netlist's own errors are.
#pragma once

#include <string>

#include "hal/component.hpp"
#include "hal/texts.hpp"
#include "vision/capture/camera.hpp"

namespace hal::vision {

/// Says all problems at their places and ends the constructor, if there are any. [setup]
template <class Problems>
void refuse(const hal::Texts& texts, const std::string& file, const std::string& text, const char* code, const Problems& problems) {
    if (problems.empty()) return;
    texts.begin(file, text);
    for (const auto& p : problems) texts.say(HAL_SEVERITY_ERROR, code, p.begin, p.end, p.sentence, "", p.help);
    if (texts.offered()) hal::Texts::refuse();
    throw std::invalid_argument(file + ": " + problems.front().sentence + "; " + problems.front().help);
}

/// The camera that `file` is about. In a component's constructor. [setup]
inline Camera camera_from(const hal::Texts& texts, const std::string& file) {
    const std::string text = texts.read("camera", file);
    CameraText        read = read_camera(text);
    refuse(texts, file, text, "camera-text", read.problems);
    read.camera.file = file;
    return read.camera;
}

}  // namespace hal::vision
