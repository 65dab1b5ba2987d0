// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "link/line.hpp"

namespace hal::line::sim {

Opened open(const std::string& target, const Options&);
Description describe(const std::string& target);

}  // namespace hal::line::sim
