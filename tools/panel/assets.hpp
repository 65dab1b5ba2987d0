// SPDX-License-Identifier: MIT
// The files of page/, which the build puts into the program.
#pragma once

#include <span>

#include "panel/http.hpp"

namespace hal::tools {

extern const std::span<const Asset> assets;

}  // namespace hal::tools
