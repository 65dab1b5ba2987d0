// SPDX-License-Identifier: MIT
// Files of a user's that cameras' components read: where they are, and what is wrong in them said as the netlist's own errors are.
#pragma once

#include <fstream>
#include <string>

#include "hal/component.hpp"
#include "hal/texts.hpp"
#include "vision/capture/camera.hpp"

namespace hal::vision {

/// The text of `file`, the value of the argument `argument`. Throws when it cannot be read or is longer than 64 KiB. [setup]
inline std::string read_text(const hal::Texts& texts, const char* argument, const std::string& file) {
    const std::string path = texts.find(file);
    std::ifstream     stream(path, std::ios::binary);
    std::string       text(65536, '\0');
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    if (stream.gcount() == static_cast<std::streamsize>(text.size()))
        throw std::invalid_argument(path + " is longer than 64 KiB; " + argument + "= names a text file");
    if (!stream.eof() || stream.bad())
        throw std::invalid_argument(std::string("cannot read ") + path + "; " + argument + "= is looked for beside the netlist");
    text.resize(static_cast<std::size_t>(stream.gcount()));
    return text;
}

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
    const std::string text = read_text(texts, "camera", file);
    CameraText        read = read_camera(text);
    refuse(texts, file, text, "camera-text", read.problems);
    read.camera.file = file;
    return read.camera;
}

}  // namespace hal::vision
