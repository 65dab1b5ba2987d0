// SPDX-License-Identifier: MIT
// Which diagnostics are rendered, and in which order. Internal to this folder.
#pragma once

#include <cstddef>
#include <vector>

namespace hal {

class Diagnostics;

inline constexpr std::size_t max_rendered = 100;

/// Returns the indices of the diagnostics that are rendered, at most max_rendered: in order of
/// place, files in order of first mention.
std::vector<std::size_t> rendered_order(const Diagnostics& diagnostics);

}  // namespace hal
