// SPDX-License-Identifier: MIT
// What a user gives a camera's components: a picture from a folder, the calibration of a camera or
// of the ground, an address. The first byte chooses which.
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>

#include "tests/fuzz/driver/require.hpp"
#include "vision/capture/camera.hpp"
#include "vision/capture/pnm.hpp"
#include "vision/capture/source.hpp"
#include "vision/detect/homography.hpp"

using namespace hal::vision;

namespace {

using hal::fuzz::require;

void picture(const std::uint8_t* bytes, std::size_t count) {
    Frame frame;
    if (const auto problem = read_pnm(bytes, count, frame)) {
        require(problem->kind == FrameError::damaged || problem->kind == FrameError::too_large,
                "the kind of the problem is reported");
        require(frame.pixels.size() <= 3 * max_pixels,
                "no picture takes more memory than one may have");
        return;
    }
    require(Frame::fits(frame.width, frame.height), "a picture has a size that one may have");
    require(frame.pixels.size() == frame.stride() * static_cast<std::size_t>(frame.height),
            "the number of pixels matches the size");
    const std::string written = write_pnm(frame);
    Frame again;
    require(
        !read_pnm(reinterpret_cast<const std::uint8_t*>(written.data()), written.size(), again) &&
            again.pixels == frame.pixels,
        "what was written is read back");
    to_grey(frame);
    require(frame.pixels.size() ==
                static_cast<std::size_t>(frame.width) * static_cast<std::size_t>(frame.height),
            "grey has a byte per pixel");
}

template <class Problems>
void places(const Problems& problems, std::size_t size) {
    for (const auto& p : problems) {
        require(p.begin <= p.end && p.end <= size && !p.sentence.empty(),
                "a problem has a place in the text");
    }
}

void camera(const std::string& text) {
    const CameraText read = read_camera(text);
    places(read.problems, text.size());
    if (!read.problems.empty()) return;
    const Camera& c = read.camera;
    require(c.width >= 1 && c.height >= 1 && c.fx > 0 && c.fy > 0 && std::isfinite(c.cx) &&
                std::isfinite(c.cy),
            "a camera that is taken is one");
}

void ground(const std::string& text) {
    GroundText read = read_ground(text);
    const Ground made(read, std::nullopt);
    places(read.problems, text.size());
    if (!read.problems.empty()) return;
    for (const GroundPoint& p : read.points) {
        double x = 0;
        double y = 0;
        made.map(p.u, p.v, x, y);
        require(std::isfinite(x) && std::isfinite(y), "a place is a number");
    }
}

void address(const std::string& text) {
    try {
        const auto source = make_source(text, {});
        require(source != nullptr, "an address that is taken is a source");
    } catch (const std::invalid_argument& e) {
        require(*e.what() != '\0', "a rejection has a reason");
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size == 0) return 0;
    const std::string text(reinterpret_cast<const char*>(data) + 1, size - 1);
    switch (data[0]) {
    case 'p': picture(data + 1, size - 1); break;
    case 'c': camera(text); break;
    case 'g': ground(text); break;
    default: address(text); break;
    }
    return 0;
}
