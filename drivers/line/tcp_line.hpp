// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "link/line.hpp"

namespace hal::line::tcp {

Opened open(const std::string& target, const Options&);
Description describe(const std::string& target);
/// Returns HOST:PORT of a target that may have no port.
std::string with_port(const std::string& target);
/// A port of this machine, PORT of 127.0.0.1 or HOST:PORT; one connection at a time.
Opened open_listener(const std::string& target, const Options&);
Description describe_listener(const std::string& target);

}  // namespace hal::line::tcp
