// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "link/line.hpp"

namespace hal::line::tcp {

Opened open(const std::string& target, const Options&);
Description describe(const std::string& target);
/// A port of this machine; one connection at a time.
Opened open_listener(const std::string& port, const Options&);
Description describe_listener(const std::string& port);

}  // namespace hal::line::tcp
