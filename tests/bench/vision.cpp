// SPDX-License-Identifier: MIT
// What looking at a frame costs the helper thread, and how well a marker is placed: frames of
// vision_scene, 640 x 480, focal length 600 px, noise of 3 of 255, a marker of 50 mm at 0.25 to 0.5
// m, turned up to 40 degrees.
#include "bench.hpp"

#if HALCYON_PACKAGE_VISION
#include <algorithm>
#include <chrono>
#include <cmath>
#include <fmt/core.h>
#include <random>
#include <vector>

#include "vision/detect/marker.hpp"
#include "vision/scene/render.hpp"

namespace hal::bench {
namespace {

using namespace hal::vision;
constexpr double pi = 3.14159265358979323846;

struct Measured {
    double mean_mm = 0;
    double max_mm = 0;
    double median_ms = 0;
    int missed = 0;
};

Measured markers(double noise, int poses) {
    Camera camera;
    camera.width = 640;
    camera.height = 480;
    camera.fx = camera.fy = 600;
    camera.cx = 319.5;

    camera.cy = 239.5;
    MarkerDetector detector("4x4_50", camera);
    std::mt19937 random(1);
    const auto between = [&](double min, double max) {
        return min + (max - min) * static_cast<double>(random()) / 4294967295.0;
    };
    scene::Settings of;
    of.kind = scene::Kind::markers;
    of.width = 640;
    of.height = 480;
    of.focal = 600;
    of.markers = 1;
    Measured m;
    std::vector<double> times;
    for (int i = 0; i < poses; ++i) {
        const double z = between(0.25, 0.5);
        const double x = between(-0.25, 0.25) * z;

        const double y = between(-0.2, 0.2) * z;
        const double pose[] = {static_cast<double>(i % 50),
                               0.05,
                               x,
                               y,
                               z,
                               pi + between(-0.7, 0.7),
                               between(-0.7, 0.7),
                               between(-pi, pi)};
        scene::State state;
        state.values[scene::at::light] = 1.0;
        state.values[scene::at::noise] = noise;
        std::copy(std::begin(pose), std::end(pose), state.values.begin() + scene::at::markers);
        Frame frame;
        frame.resize(640, 480, Format::bgr);
        frame.pixels = scene::render(of, state, state, static_cast<std::uint64_t>(i));
        to_grey(frame);
        const auto begin = std::chrono::steady_clock::now();
        const auto found = detector.find(frame, -1, 50);
        times.push_back(
            std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin)
                .count());
        if (found.size() != 1) {
            ++m.missed;
            continue;
        }
        const Pose& p = found[0].pose;
        const double error = std::hypot(x * 1000 - p.x_mm, y * 1000 - p.y_mm, z * 1000 - p.z_mm);
        m.mean_mm += error;
        m.max_mm = std::max(m.max_mm, error);
    }
    m.mean_mm /= std::max(1, poses - m.missed);
    std::nth_element(times.begin(), times.begin() + poses / 2, times.end());
    m.median_ms = times[static_cast<std::size_t>(poses) / 2];
    return m;
}

}  // namespace

void vision(const Options& options, Report& report) {
    report.section("markers in frames of 640 x 480");
    const int poses = options.quick ? 50 : 200;
    for (const double noise : {3.0, 8.0}) {
        const Measured m = markers(noise, poses);
        report.row({.what = fmt::format("position error, mean of {} poses, noise {:g}",
                                        poses - m.missed, noise),
                    .unit = "mm",
                    .ours = m.mean_mm,
                    .goal = noise == 3.0 ? limit(1.5) : Goal{}});
        report.row({.what = "  the largest", .unit = "mm", .ours = m.max_mm});
        report.row({.what = fmt::format("  time for a frame, median; {} of {} were not found",
                                        m.missed, poses),
                    .unit = "ms",
                    .ours = m.median_ms});
    }
}

}  // namespace hal::bench
#else
namespace hal::bench {

void vision(const Options&, Report& report) {
    report.section("markers in frames of 640 x 480");
    report.note("not measured: a build without OpenCV");
}

}  // namespace hal::bench
#endif
