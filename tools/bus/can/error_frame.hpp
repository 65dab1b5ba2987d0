// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "link/can.hpp"

namespace hal::tools {

/// Returns what an error frame of a controller reports: "bus off; send errors 128, …". [setup]
std::string error_frame_text(const can::Frame&);

}  // namespace hal::tools
