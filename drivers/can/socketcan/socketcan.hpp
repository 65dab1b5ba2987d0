// SPDX-License-Identifier: MIT
#pragma once

#include "link/can.hpp"

namespace hal::can::socketcan {

/// `can:INTERFACE`: a network interface of the kernel that is a CAN bus. [setup]
Opened open(const std::string& interface, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& interface);

}  // namespace hal::can::socketcan
