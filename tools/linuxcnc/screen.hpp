// SPDX-License-Identifier: MIT
// The screen of programs that open windows.
#pragma once

#include <string>

namespace hal::tools {

/// Returns why programs that are started here cannot open windows: "the environment has no
/// DISPLAY"; empty when they can, or when only they can find out, as on another computer's screen.
std::string screen_problem();

}  // namespace hal::tools
