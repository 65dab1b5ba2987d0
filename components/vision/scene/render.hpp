// SPDX-License-Identifier: MIT
// From a state of the scene to the picture a camera takes of it.
#pragma once

#include <cstdint>
#include <vector>

#include "vision/scene/canvas.hpp"
#include "vision/scene/stage.hpp"

namespace hal::vision::scene {

/// The picture (8 bit, blue green red) of an exposure that begins with `from` and ends with `to`; the light, the noise and what is in the
/// way are those of `to`. The same settings, states and `number` give the same bytes on any machine. [any] takes memory
std::vector<std::uint8_t> render(const Settings& settings, const State& from, const State& to, std::uint64_t number);

/// The parts of it: see the manual of vision_scene for what stands where.
void draw_furuta(Canvas& canvas, const Settings& settings, const State& from, const State& to);
void draw_floor(Canvas& canvas, const Settings& settings, const State& state);
void draw_markers(Canvas& canvas, const Settings& settings, const State& state);

}  // namespace hal::vision::scene
