// SPDX-License-Identifier: MIT
#pragma once

#include "link/can.hpp"

namespace hal::can::socketcan {

/// Opens `can:INTERFACE`: a CAN network interface of the kernel. [setup]
Opened open(const std::string& interface, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& interface);

}  // namespace hal::can::socketcan
