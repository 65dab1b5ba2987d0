// SPDX-License-Identifier: MIT
#pragma once

#include <string>

#include "link/line.hpp"

namespace hal::line::serial {

Opened open(const std::string& target, const Options&);
Description describe(const std::string& target);
/// A pseudo terminal, with a symbolic link of this path to its other end.
Opened open_pty(const std::string& path, const Options&);
Description describe_pty(const std::string& path);

}  // namespace hal::line::serial
