// SPDX-License-Identifier: MIT
// Renders the picture that a camera takes of a scene.
#pragma once

#include <cstdint>
#include <vector>

#include "vision/scene/canvas.hpp"
#include "vision/scene/stage.hpp"

namespace hal::vision::scene {

/// Renders the picture (8 bit; blue, green, red) of an exposure from state `from` to state `to`;
/// light, noise and occlusion are those of `to`. The same settings, states and `number` give the
/// same bytes each time. [any] allocates memory
std::vector<std::uint8_t> render(const Settings& settings, const State& from, const State& to,
                                 std::uint64_t number);

/// Draw one part of the scene each; the manual of vision_scene describes their layout.
void draw_furuta(Canvas& canvas, const Settings& settings, const State& from, const State& to);
void draw_floor(Canvas& canvas, const Settings& settings, const State& state);
void draw_markers(Canvas& canvas, const Settings& settings, const State& state);

}  // namespace hal::vision::scene
