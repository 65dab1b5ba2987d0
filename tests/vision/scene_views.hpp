// SPDX-License-Identifier: MIT
// Frames of scenes whose truth is known.
#pragma once

#include <cmath>

#include "vision/capture/frame.hpp"
#include "vision/scene/render.hpp"

namespace hal::vision::test {

/// A state with usual light, noise of 3 and a blur of 0.6 px.
inline scene::State usual_state() {
    scene::State state;
    state.values[scene::at::light] = 1.0;
    state.values[scene::at::noise] = 3.0;
    state.values[scene::at::blur] = 0.6;
    return state;
}

inline scene::State rig_state(double arm, double pendulum) {
    scene::State state = usual_state();
    state.values[scene::at::arm] = arm;
    state.values[scene::at::pendulum] = pendulum;
    return state;
}

inline Frame frame_of(const scene::Settings& settings, const scene::State& from,
                      const scene::State& to, std::uint64_t number) {
    Frame frame;
    frame.resize(settings.width, settings.height, Format::bgr);
    frame.pixels = scene::render(settings, from, to, number);
    frame.number = number;
    return frame;
}

/// A number between `least` and `most` that is spread evenly over n = 0, 1, 2 … `step`: a prime for
/// each quantity. (R. Richtmyer, 1951)
inline double spread(int n, double step, double min, double max) {
    const double part = n * std::sqrt(step);
    return min + (max - min) * (part - std::floor(part));
}

}  // namespace hal::vision::test
