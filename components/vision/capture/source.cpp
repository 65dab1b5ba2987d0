// SPDX-License-Identifier: MIT
#include "vision/capture/source.hpp"

#include <stdexcept>

#include "hal/rejection.hpp"

namespace hal::vision {

void to_grey(Frame& frame) {
    if (frame.format == Format::grey) return;
    const std::size_t count = frame.pixels.size() / 3;
    for (std::size_t i = 0; i < count; ++i) {
        // never behind the place that is written
        const std::uint8_t* const p = frame.pixels.data() + 3 * i;
        frame.pixels[i] =
            static_cast<std::uint8_t>((29 * p[0] + 150 * p[1] + 77 * p[2] + 128) >> 8);
    }
    frame.format = Format::grey;
    frame.pixels.resize(count);
}

const char* to_string(FrameError error) {
    static constexpr const char* names[frame_error_count] = {
        "none",      "missing", "unusable", "unplugged",  "no frames",   "damaged",
        "too large", "black",   "frozen",   "wrong size", "end of files"};
    return names[static_cast<std::size_t>(error)];
}

std::unique_ptr<Source> make_source(const std::string& address,
                                    const std::function<std::string(const std::string&)>& find) {
    Address parsed(address);
    if (parsed.driver() == "v4l2") return v4l2_source(std::move(parsed));
    if (parsed.driver() == "frames") return frames_source(std::move(parsed), find);
    if (parsed.driver() == "sim") return sim_source(std::move(parsed));
    throw hal::ArgumentError("source",
                             "source=" + address + ": there is no source '" + parsed.driver() +
                                 ":'; write v4l2:/dev/video0, frames:FOLDER or sim:SCENE");
}

}  // namespace hal::vision
