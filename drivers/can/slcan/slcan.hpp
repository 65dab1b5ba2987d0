// SPDX-License-Identifier: MIT
#pragma once

#include "link/can.hpp"

namespace hal::can::slcan {

/// `slcan:DEVICE`: an adapter on a serial line, or whoever is at the other end of a pseudo-terminal. [setup]
Opened open(const std::string& device, const Options&);
/// Describes what open() would return, as far as the place determines it. [setup]
Description describe(const std::string& device);

}  // namespace hal::can::slcan
